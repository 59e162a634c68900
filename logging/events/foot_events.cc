#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "components/balance/contact_conditions.h"
#include "components/balance/convex_polygon.h"
#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/events/event_groups.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"

namespace poise::logging {
namespace {

constexpr double kShortestLoss = 0.01;  // s; shorter is the foot's rattle, and the sensor's noise

// A sole that tips: of its load in the weight, of its centre of pressure from its edge (m), and how
// long (s).
constexpr double kTipsShare = 0.3, kTipsDistance = 1e-3, kTipsGap = 0.01, kLeastTipping = 0.03;

}  // namespace

void AddFootEvents(const RunRecord& run, bool ended, EventList* events) {
  const planner_status_t* before = nullptr;
  for (const auto& [tick, planner] : Messages(run.planner, 0, run.num_ticks)) {
    for (size_t foot = 0; before != nullptr && foot < 2; ++foot) {
      const int8_t is = planner->foot_state[foot];
      if (is == before->foot_state[foot]) continue;
      const double height = kMilli * (planner->foot_pose[foot].position[2] -
                                      planner->foot_pose[1 - foot].position[2]);
      if (is == planner_status_t::FOOT_SEARCHING) {
        events->Add(tick, "searching",
                    fmt::format("{} without contact {:.1f} mm above the other sole",
                                FootName(run, foot), height));
      } else if (is == planner_status_t::FOOT_RETRACTED) {
        events->Add(tick, "no_surface",
                    fmt::format("{} found no surface down to {:.1f} mm above the other sole; "
                                "retracted",
                                FootName(run, foot), height));
      }
    }
    before = planner;
  }
  for (const TouchDown& touch : TouchDowns(run)) {
    const std::string foot = FootName(run, touch.foot);
    events->Add(touch.tick, "touch_down",
                fmt::format("{}, {:.1f} mm above the other sole", foot, kMilli * touch.height));
    if (touch.timing != Timing::kEarly && touch.timing != Timing::kLate) continue;
    const bool early = touch.timing == Timing::kEarly;
    events->Add(touch.tick, early ? "contact_early" : "contact_late",
                fmt::format("{}, {:.1f} mm {} the end of its reference", foot,
                            kMilli * std::abs(*touch.above_end), early ? "above" : "below"));
  }
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto lost = [&](int64_t tick) -> std::optional<bool> {
      if (run.command.at(tick - 1) == nullptr || run.sensors.at(tick) == nullptr) return {};
      return ContactLost(run, foot, tick).value_or(false);
    };
    std::vector<Interval> intervals = Intervals(run, lost);
    std::erase_if(intervals, [&](const Interval& i) {
      if (!i.end && ended) return false;
      return run.duration(i.end.value_or(run.num_ticks) - i.begin) < kShortestLoss;
    });
    events->AddIntervals(intervals, "contact_lost", "contact_regained", [&](int64_t tick) {
      const double load = -run.command.at(tick - 1)->foot_wrench[foot].force[2];
      return fmt::format("{}, which was to carry {:.0f} N", FootName(run, foot), load);
    });
  }
}

void AddSoleEvents(const RunRecord& run, EventList* events) {
  const double least = kTipsShare * run.robot.total_mass() * robot::kGravity;
  const auto gap = static_cast<int64_t>(std::ceil(kTipsGap / run.spec.tick_period()));
  for (size_t foot = 0; foot < 2; ++foot) {
    const balance::ConvexPolygon sole = balance::SolePolygon(run.robot.feet()[foot], 0);
    const auto tips = OfTick(run.truth, [&](const ground_truth_t& truth) {
      const balance::Vector6d wrench = GetWrench(truth.foot_wrench[foot]);
      if (truth.fallen != 0 || -wrench[2] < least) return false;
      return balance::SignedDistance(sole, balance::CenterOfPressure(wrench)) < kTipsDistance;
    });
    std::vector<Interval> intervals = Intervals(run, tips, gap);
    std::erase_if(intervals, [&](const Interval& i) {
      return run.duration(i.end.value_or(run.num_ticks) - i.begin) < kLeastTipping;
    });
    const auto lasts = static_cast<int64_t>(std::llround(kLeastTipping / run.spec.tick_period()));
    events->AddIntervals(intervals, "sole_on_edge", "sole_on_edge_ends", [&](int64_t tick) {
      // The load told is the median: an impact of a tick or two carries nothing.
      std::vector<double> loads;
      for (const auto& [t, truth] :
           Messages(run.truth, tick, std::min(tick + lasts, run.num_ticks))) {
        loads.push_back(-truth->foot_wrench[foot].force[2]);
      }
      const auto middle = loads.begin() + static_cast<std::ptrdiff_t>(loads.size() / 2);
      std::ranges::nth_element(loads, middle);
      return fmt::format("{}, which carried {:.0f} N", FootName(run, foot), *middle);
    });
  }
}

}  // namespace poise::logging
