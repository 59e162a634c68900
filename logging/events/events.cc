#include "logging/events/events.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/events/event_groups.h"
#include "logging/events/operator_words.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/true_contacts.h"

namespace poise::logging {
namespace {

// A push that comes back sooner is the same push, s.
constexpr double kPushGap = 0.05;

// An operator's act that is refused sooner than this after one like it is the same attempt, s.
constexpr double kRefusalGap = 1;

void AddPush(const RunRecord& run, bool ended, EventList* events) {
  const double threshold = PushThreshold(run);
  const auto size_at =
      OfTick(run.push, [](const external_push_t& push) { return GetVector3(push.force).norm(); });
  const auto pushed = OfTick(run.push, [&](const external_push_t& push) {
    return GetVector3(push.force).norm() > threshold;
  });
  const auto gap = static_cast<int64_t>(std::ceil(kPushGap / run.spec.tick_period()));
  for (const Interval& interval : Intervals(run, pushed, gap)) {
    int64_t peak = interval.begin;
    for (int64_t tick = peak; tick < interval.end.value_or(run.num_ticks); ++tick) {
      if (size_at(tick).value_or(0) > *size_at(peak)) peak = tick;
    }
    const Eigen::Vector3d force = GetVector3(run.push.at(peak)->force);
    events->Add(interval.begin, "push_begins", fmt::format("above {:.2g} N", threshold));
    if (!interval.end && !ended) continue;
    events->Add(peak, "push_peak",
                fmt::format("{:.1f} N, ({:.1f}, {:.1f}, {:.1f})", force.norm(), Tenths(force.x()),
                            Tenths(force.y()), Tenths(force.z())));
    events->AddEndOf(interval, "push_ends", fmt::format("peak {:.1f} N", force.norm()));
  }
}

void AddCrane(const RunRecord& run, EventList* events) {
  double most = 0;
  bool held = false;
  for (const auto& [tick, truth] : Messages(run.truth, 0, run.num_ticks)) {
    if (held && truth->crane_share == 0) {
      events->Add(tick, "crane_let_go",
                  fmt::format("it carried {:.0f} N at most, {:.3f} s after the start", most,
                              run.duration(tick)));
      return;
    }
    if (!held && truth->crane_share == 0) return;  // no crane
    held = true;
    most = std::max(most, GetVector3(truth->crane_force).norm());
  }
}

/// An operator's acts that were refused. A page that is dragged sends many a second: those of one
/// component with one reason are one event until kRefusalGap has passed without one.
void AddRefusals(const RunRecord& run, EventList* events) {
  struct Refusal {
    int64_t begin, last;  // ticks
    int count;
  };
  std::map<std::tuple<int32_t, int8_t, int8_t>, std::vector<Refusal>> refusals;
  std::set<std::pair<int32_t, int64_t>> heard;  // an act sent again is answered again
  for (const operate::answer_t& answer : run.answers) {
    const bool within = answer.tick >= 0 && answer.tick <= run.num_ticks;
    if (answer.verdict == operate::answer_t::VERDICT_DONE || !within) continue;
    if (!heard.emplace(answer.component, answer.id).second) continue;
    std::vector<Refusal>& same = refusals[{answer.component, answer.kind, answer.verdict}];
    const bool more =
        !same.empty() && run.duration(std::abs(answer.tick - same.back().last)) < kRefusalGap;
    if (more) {
      same.back().last = answer.tick;
      ++same.back().count;
    } else {
      same.push_back({answer.tick, answer.tick, 1});
    }
  }
  for (const auto& [what, list] : refusals) {
    const auto& [component, kind, verdict] = what;
    const Graph& graph = run.spec.graph();
    const bool known = component >= 0 && component < graph.component_size();
    for (const Refusal& refusal : list) {
      events->Add(refusal.begin, "act_refused",
                  fmt::format("{} by {}: {}{}", ActKindName(kind),
                              known ? graph.component(component).name()
                                    : fmt::format("component {}", component),
                              RefusalReason(kind, verdict),
                              refusal.count > 1 ? fmt::format("; {} times", refusal.count) : ""));
    }
  }
}

void AddEnd(const RunRecord& run, bool ended, EventList* events) {
  if (const std::optional<int64_t> down = DownTick(run)) {
    events->Add(*down, "fall",
                fmt::format("true COM {:.3f} m high", run.truth.at(*down)->com_position[2]));
  }
  if (!ended) return;
  if (run.spec.has_cut()) {
    events->Add(run.num_ticks, "log_ends", "a part of a longer log");
    return;
  }
  const int64_t planned = run.spec.num_ticks();
  events->Add(run.num_ticks, "run_ended",
              planned > run.num_ticks ? fmt::format("{:.3f} s before its planned end",
                                                    run.duration(planned - run.num_ticks))
              : planned > 0           ? "planned end"
                                      : "no end was planned");
}

}  // namespace

std::vector<Event> Events(const RunRecord& run, bool ended) {
  EventList events(run);
  AddPlanEvents(run, &events);
  AddFootEvents(run, ended, &events);
  AddSensorEvents(run, &events);
  AddBalanceEvents(run, &events);
  AddMotorEvents(run, &events);
  AddSoleEvents(run, &events);
  AddBridgeEvents(run, &events);
  AddPush(run, ended, &events);
  AddCrane(run, &events);
  AddRefusals(run, &events);
  AddEnd(run, ended, &events);
  std::vector<Event> sorted = std::move(events).Sorted();
  if (run.spec.cut().first_tick() > 0) {
    const double first = run.time(run.spec.cut().first_tick());
    for (Event& event : sorted) {
      if (event.time > first) break;
      event.detail += "; or earlier, where the log does not reach";
    }
  }
  return sorted;
}

}  // namespace poise::logging
