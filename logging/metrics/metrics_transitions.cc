#include <algorithm>
#include <cmath>

#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/schedule_plan.h"

namespace poise::logging {
namespace {

// A load of this share of the robot's weight has a centre of pressure that stands out of a sensor
// noise of 1 N.
constexpr double kReadableShare = 0.01;
// Figure 17 shows half a second after the switch; what moves before it is not its doing.
constexpr double kBeforeSwitch = 0.05, kAfterSwitch = 0.5;  // s

/// mm, from lowest to highest, of the foot that stops being a support, about that tick.
Answer LiftMotion(const RunRecord& run) {
  const auto before = std::llround(kBeforeSwitch / run.spec.tick_period());
  const auto after = std::llround(kAfterSwitch / run.spec.tick_period());
  Answer largest;
  for (const SupportChange& change : SupportChanges(run)) {
    if (change.tick < run.first_tick) continue;
    for (size_t foot = 0; foot < 2; ++foot) {
      if (!change.lifted(foot)) continue;
      Answer low, high;
      const int64_t begin = change.tick - before, end = change.tick + after + 1;
      for (const auto& [t, truth] : Messages(run.truth, begin, end)) {
        const double z = truth->foot_pose[foot].position[2];
        low = std::min(low.value_or(z), z);
        high = std::max(high.value_or(z), z);
      }
      if (low) largest = std::max(largest, Answer(kMilli * (*high - *low)));
    }
  }
  return largest;
}

/// First tick at which `foot` stands again after it was off the ground: its contact confirmed, or,
/// where nothing confirms, a support.
std::optional<int64_t> FirstStand(const RunRecord& run, size_t foot) {
  for (const TouchDown& touch : TouchDowns(run)) {
    if (touch.foot == foot && touch.tick >= run.first_tick) return touch.tick;
  }
  for (const SupportChange& change : SupportChanges(run)) {
    if (change.tick >= run.first_tick && !change.before[foot] && change.after[foot]) {
      return change.tick;
    }
  }
  return {};
}

/// mm, by which a foot that was set down went lower until it was lifted again.
Answer Sink(const RunRecord& run, size_t foot) {
  const std::optional<int64_t> stand = FirstStand(run, foot);
  if (!stand) return {};
  int64_t end = run.num_ticks;
  for (const SupportChange& change : SupportChanges(run)) {
    if (change.tick > *stand && change.lifted(foot)) {
      end = change.tick;
      break;
    }
  }
  const auto height =
      OfTick(run.truth, [foot](const auto& truth) { return truth.foot_pose[foot].position[2]; });
  const Answer start = height(*stand);
  if (!start) return {};
  double lowest = *start;
  for (int64_t t = *stand; t < end; ++t) lowest = std::min(lowest, height(t).value_or(lowest));
  return kMilli * (*start - lowest);
}

/// Roll (32) or pitch (33) of a sole: where its margin and its moment stand.
struct Edge {
  const char* name;
  size_t margin, moment;
};
constexpr Edge kEdges[] = {{"roll", 3, 0}, {"pitch", 4, 1}};

/// m, half of the sole's width or length on one foot [0] and on both [1], as the command's own
/// margins have it: margin = half |F_z| - |M|, at the tick of the largest load.
std::array<Answer, 2> SoleHalf(const RunRecord& run, size_t foot, const Edge& edge) {
  std::array<Answer, 2> half;
  std::array<double, 2> largest{};
  for (int64_t t = 0; t < run.num_ticks; ++t) {
    const Answer margin = FootMargin(run, foot, edge.margin, t);
    if (!margin) continue;
    const joint_command_t& command = *run.command.at(t);
    const size_t support = command.in_contact[0] != 0 && command.in_contact[1] != 0 ? 1 : 0;
    const double load = std::abs(command.foot_wrench[foot].force[2]);
    if (load <= largest[support]) continue;
    largest[support] = load;
    half[support] = (*margin + std::abs(command.foot_wrench[foot].moment[edge.moment])) / load;
  }
  return half;
}

/// True when the reading at a tick breaks the condition; empty out of contact or unloaded.
auto MeasuredViolation(size_t foot, const Edge& edge) {
  return [foot, edge](const RunRecord& run) {
    return [&run, foot, edge, half = SoleHalf(run, foot, edge)](int64_t t) -> std::optional<bool> {
      const joint_command_t* command = run.command.at(t - 1);
      const auto wrench = KnownWrench(run, foot, t);
      if (command == nullptr || !wrench || command->in_contact[foot] == 0) return {};
      const Answer limit = half[command->in_contact[0] != 0 && command->in_contact[1] != 0 ? 1 : 0];
      const double load = -(*wrench)[2];
      if (!limit || load < kReadableShare * run.robot.total_mass() * robot::kGravity) return {};
      return std::abs((*wrench)[3 + edge.moment]) > load * *limit;
    };
  };
}

void AddViolations(MetricList* list) {
  for (size_t foot = 0; foot < 2; ++foot) {
    for (const Edge& edge : kEdges) {
      const auto violated = MeasuredViolation(foot, edge);
      const auto after_contact = [=](const RunRecord& run) {
        return [stand = FirstStand(run, foot),
                violated = violated(run)](int64_t t) -> std::optional<bool> {
          if (!stand || t < *stand) return {};
          return violated(t);
        };
      };
      const std::string name = fmt::format("{}_foot_{}_violation", kFoot[foot], edge.name);
      const std::string breaks =
          fmt::format("which the measured wrench of the loaded {} foot breaks ({})", kFoot[foot],
                      29 + edge.margin);
      list->Add(name + "_measured", "s", "time in " + breaks, TimeOf(violated));
      list->Add(name + "_after_contact", "s", "time in " + breaks + " after it was set down",
                TimeOf(after_contact));
      list->Add(name + "_first", "s", "first time at " + breaks, FirstTime(violated));
    }
  }
}

Answer FirstTouchDown(const RunRecord& run) {
  for (const TouchDown& touch : TouchDowns(run)) {
    if (touch.tick >= run.first_tick) return run.time(touch.tick);
  }
  return {};
}

/// How many touch-downs came so; none where the plan does not tell.
Compute ContactCount(Timing timing) {
  return [timing](const RunRecord& run) -> Answer {
    if (run.planner.empty() || run.plan.empty() || !ReadSchedulePlan(run)) return {};
    int found = 0;
    for (const TouchDown& touch : TouchDowns(run)) {
      if (touch.tick < run.first_tick) continue;
      if (touch.timing == Timing::kUnknown) return {};
      found += touch.timing == timing ? 1 : 0;
    }
    return found;
  };
}

Answer NoSurfaceStops(const RunRecord& run) {
  if (run.planner.empty()) return {};
  std::ptrdiff_t stops = 0;
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto retracted = OfTick(run.planner, [foot](const planner_status_t& planner) {
      return planner.foot_state[foot] == planner_status_t::FOOT_RETRACTED;
    });
    stops += std::ranges::count_if(Intervals(run, retracted), [&](const Interval& stop) {
      return stop.begin >= run.first_tick;
    });
  }
  return static_cast<double>(stops);
}

/// Tells whether either foot has lost its contact; nothing where neither foot is known.
std::optional<bool> AnyContactLost(const RunRecord& run, int64_t t) {
  const auto right = ContactLost(run, 0, t), left = ContactLost(run, 1, t);
  if (!right && !left) return {};
  return right.value_or(false) || left.value_or(false);
}

}  // namespace

void AddTransitions(MetricList* list) {
  const std::string lift = fmt::format(
      "largest vertical motion, peak to peak, of the foot that stops being a support, from {} s "
      "before to {} s after (ground truth)",
      kBeforeSwitch, kAfterSwitch);
  list->Add("foot_lift_motion_z", "mm", lift, LiftMotion);
  list->Add("foot_lift_motion_z_reference", "mm", lift + ", reference run",
            OfReference(LiftMotion));
  for (size_t foot = 0; foot < 2; ++foot) {
    list->Add(
        fmt::format("{}_foot_sink", kFoot[foot]), "mm",
        fmt::format("how far the {} foot sinks after it was set down (ground truth)", kFoot[foot]),
        [foot](const RunRecord& run) { return Sink(run, foot); });
  }
  list->Add("touch_down", "s", "first time that the measured load of a foot that came down lasted",
            FirstTouchDown);
  list->Add("early_contacts", "", "feet that touched down above the end of the foot's reference",
            ContactCount(Timing::kEarly));
  list->Add("late_contacts", "", "feet that touched down below the end of the foot's reference",
            ContactCount(Timing::kLate));
  list->Add("no_surface_stops", "", "times that a foot found no surface and was retracted",
            NoSurfaceStops);
  list->Add("contact_lost_ticks", "",
            "ticks in which a foot that was to be loaded read no more than noise",
            TicksOf(AnyContactLost));
  AddViolations(list);
}

}  // namespace poise::logging
