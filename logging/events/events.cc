#include "logging/events/events.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "components/balance/contact_conditions.h"
#include "components/balance/convex_polygon.h"
#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/events/bridge_words.h"
#include "logging/events/operator_words.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/planner_steps.h"
#include "logging/metrics/schedule_plan.h"
#include "logging/metrics/true_contacts.h"

namespace poise::logging {
namespace {

constexpr double kShortestLoss = 0.01;  // s; shorter is the foot's rattle, and the sensor's noise

// A push that comes back sooner is the same push, s.
constexpr double kPushGap = 0.05;

// An operator's act that is refused sooner than this after one like it is the same attempt, s.
constexpr double kRefusalGap = 1;

// m of the capture point beyond what a walk's step covers: that the planner calls beyond the soles.
constexpr double kStrays = 0.01;

/// Rounded to what one decimal shows, and never "-0.0".
double Tenths(double value) {
  const double tenths = std::round(10 * value) / 10;
  return tenths == 0 ? 0 : tenths;
}

constexpr double kLimitGap = 0.1;  // s between two limits of a motor that are one

// A sole that tips: of its load in the weight, of its centre of pressure from its edge (m), and how
// long (s).
constexpr double kTipsShare = 0.3, kTipsDistance = 1e-3, kTipsGap = 0.01, kLeastTipping = 0.03;

constexpr double kKnownHeight = 5;  // mm, standard deviation of a COM that is known

class EventList {
 public:
  explicit EventList(const RunRecord& run) : run_(run) {}

  void Add(int64_t tick, std::string name, std::string detail) {
    events_.push_back({{run_.time(tick), std::move(name), std::move(detail)}, false});
  }
  /// The end of something; of one tick's events it comes first.
  void AddEndOf(const Interval& interval, std::string name, const std::string& what) {
    if (!interval.end) return;
    std::string detail =
        fmt::format("{}, after {:.3f} s", what, run_.duration(*interval.end - interval.begin));
    events_.push_back({{run_.time(*interval.end), std::move(name), std::move(detail)}, true});
  }
  /// `begin` and `end` name the events; `what` tells of the first tick, and the end adds how long
  /// it was.
  void AddIntervals(const std::vector<Interval>& intervals, const char* begin, const char* end,
                    const std::function<std::string(int64_t tick)>& what) {
    for (const Interval& interval : intervals) {
      const std::string text = what(interval.begin);
      Add(interval.begin, begin, text);
      AddEndOf(interval, end, text);
    }
  }
  std::vector<Event> Sorted() && {
    std::stable_sort(events_.begin(), events_.end(), [](const Entry& a, const Entry& b) {
      return a.event.time < b.event.time || (a.event.time == b.event.time && a.ends && !b.ends);
    });
    std::vector<Event> sorted;
    for (Entry& entry : events_) sorted.push_back(std::move(entry.event));
    return sorted;
  }

 private:
  struct Entry {
    Event event;
    bool ends;
  };
  const RunRecord& run_;
  std::vector<Entry> events_;
};

/// What the phase before came to, where that is not its planned end; else empty.
std::string OutcomeText(int8_t outcome) {
  switch (outcome) {
    case support_plan_t::OUTCOME_NO_SURFACE:
      return ": no surface was found";
    case support_plan_t::OUTCOME_CONTACT_LOST:
      return ": a contact was lost";
    case support_plan_t::OUTCOME_TIMEOUT:
      return ": the phase before had waited for too long";
    default:
      return "";
  }
}

void AddPhases(const RunRecord& run, EventList* events) {
  const std::optional<SchedulePlan> schedule = ReadSchedulePlan(run);
  std::optional<int32_t> phase;
  double last_time = 0;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const support_plan_t* plan = run.plan.at(tick);
    if (plan == nullptr) continue;
    // A phase may follow itself: then its time begins anew.
    const bool began = plan->phase != phase || plan->phase_time < last_time;
    last_time = plan->phase_time;
    if (!began) continue;
    phase = plan->phase;
    const auto i = static_cast<size_t>(*phase);
    const bool named = schedule && i < schedule->phases.size() && !schedule->phases[i].name.empty();
    events->Add(tick, "phase_began",
                (named ? fmt::format("phase {}, {}", *phase, schedule->phases[i].name)
                       : fmt::format("phase {}", *phase)) +
                    OutcomeText(plan->began_by));
  }
}

void AddSupport(const RunRecord& run, EventList* events) {
  for (const SupportChange& change : SupportChanges(run)) {
    events->Add(change.tick, "support_changed",
                fmt::format("{} to {}; largest torque step {:.3g} N·m in {}",
                            SupportName(run, change.before), SupportName(run, change.after),
                            change.torque_step, run.robot.joints()[change.joint].name));
  }
}

void AddTransitions(const RunRecord& run, EventList* events) {
  for (const auto& [kind, begin, end] :
       {std::tuple{support_plan_t::TRANSITION_UNLOADING, "unloading_begins", "unloading_ends"},
        std::tuple{support_plan_t::TRANSITION_LOADING, "loading_begins", "loading_ends"}}) {
    for (size_t foot = 0; foot < 2; ++foot) {
      const auto holds = [&, wanted = kind](int64_t tick) -> std::optional<bool> {
        const support_plan_t* plan = run.plan.at(tick);
        if (plan == nullptr) return {};
        return plan->transition == wanted && plan->transition_foot == static_cast<int>(foot);
      };
      events->AddIntervals(Intervals(run, holds), begin, end,
                           [&](int64_t) { return FootName(run, foot); });
    }
  }
}

void AddWaiting(const RunRecord& run, EventList* events) {
  for (const auto& [reason, text] :
       {std::pair{support_plan_t::WAITING_COM, "for the COM to come above the stance sole"},
        std::pair{support_plan_t::WAITING_CONTACT, "for the measured load to confirm the contact"},
        std::pair{support_plan_t::WAITING_NO_SURFACE, "no surface was found"}}) {
    const auto holds = [&, wanted = reason](int64_t tick) -> std::optional<bool> {
      const support_plan_t* plan = run.plan.at(tick);
      if (plan == nullptr) return {};
      return plan->waiting_for == wanted;
    };
    events->AddIntervals(Intervals(run, holds), "waiting_begins", "waiting_ends",
                         [&, why = text](int64_t) { return std::string(why); });
  }
}

void AddFeet(const RunRecord& run, bool ended, EventList* events) {
  const support_plan_t* before = nullptr;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const support_plan_t* plan = run.plan.at(tick);
    if (plan == nullptr) continue;
    for (size_t foot = 0; before != nullptr && foot < 2; ++foot) {
      const int8_t is = plan->foot_state[foot];
      if (is == before->foot_state[foot]) continue;
      const double height =
          kMilli * (plan->foot_pose[foot].position[2] - plan->foot_pose[1 - foot].position[2]);
      if (is == support_plan_t::FOOT_SEARCHING) {
        events->Add(tick, "searching",
                    fmt::format("{} without contact {:.1f} mm above the other sole",
                                FootName(run, foot), height));
      } else if (is == support_plan_t::FOOT_RETRACTED) {
        events->Add(tick, "no_surface",
                    fmt::format("{} found no surface down to {:.1f} mm above the other sole; "
                                "retracted",
                                FootName(run, foot), height));
      }
    }
    before = plan;
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

const char* SensorFaultText(int8_t state) {
  switch (state) {
    case estimator_status_t::SENSOR_INVALID:
      return "gives no valid reading";
    case estimator_status_t::SENSOR_DEAD:
      return "reads zero";
    case estimator_status_t::SENSOR_FROZEN:
      return "reads the same all the time";
    case estimator_status_t::SENSOR_BIASED:
      return "differs from what the joints' torques show";
    default:
      return nullptr;
  }
}

void AddFootSensors(const RunRecord& run, EventList* events) {
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto broken = [&](int64_t tick) -> std::optional<bool> {
      const estimator_status_t* status = run.estimator.at(tick);
      if (status == nullptr) return {};
      return SensorFaultText(status->foot_sensor[foot]) != nullptr;
    };
    events->AddIntervals(
        Intervals(run, broken), "foot_sensor_fault", "foot_sensor_back", [&](int64_t tick) {
          return fmt::format("{}: its sensor {}; its wrench is observed", FootName(run, foot),
                             SensorFaultText(run.estimator.at(tick)->foot_sensor[foot]));
        });
  }
}

// What calibration has found by the run's end, and what standing does not tell.
void AddCalibration(const RunRecord& run, EventList* events) {
  const estimator_status_t* last = nullptr;
  bool ran = false;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    const estimator_status_t* status = run.estimator.at(tick);
    if (status == nullptr) continue;
    last = status;
    ran = ran || status->calibration == estimator_status_t::CALIBRATION_RUNNING;
  }
  if (last == nullptr || last->calibration == estimator_status_t::CALIBRATION_OFF) return;
  if (!ran) {
    events->Add(run.num_ticks, "calibration",
                "found nothing: it needs sensors in both feet and a robot that stands still");
    return;
  }
  // Places of load_mass and load_moment on the diagonal of a packed 6 x 6 triangle.
  constexpr std::array<size_t, 4> kDiagonal = {0, 6, 11, 15};
  const double mass = run.robot.total_mass();
  std::array<double, 3> shift{}, deviation{};  // mm of the whole robot's COM
  for (size_t i = 0; i < 3; ++i) {
    shift[i] = kMilli * last->load_moment[i] / mass;
    deviation[i] =
        kMilli * std::sqrt(std::max(last->calibration_covariance[kDiagonal[i + 1]], 0.0)) / mass;
  }
  events->Add(
      run.num_ticks, "calibration",
      fmt::format(
          "load {:.2f} ± {:.2f} kg, which moves the COM by {:.1f} ± {:.1f}, {:.1f} ± {:.1f}, "
          "{:.1f} ± {:.1f} mm{}; IMU turned by {:.1f}, {:.1f} mrad, its "
          "accelerometer's bias as an angle included",
          last->load_mass, std::sqrt(std::max(last->calibration_covariance[0], 0.0)), shift[0],
          deviation[0], shift[1], deviation[1], shift[2], deviation[2],
          deviation[2] > kKnownHeight ? " (along z standing still does not tell it)" : "",
          kMilli * last->imu_tilt[0], kMilli * last->imu_tilt[1]));
}

/// Why the centre of pressure is not within its limits.
std::string NotAchievedText(const balance_torque_t& balance) {
  // A wrench that does not press on the ground has none, and the message has zeros.
  const double pulls = balance.resultant_task.force[2];
  if (!(pulls < 0)) {
    return fmt::format("no CoP: the task torque would pull at the ground with {:.0f} N", pulls);
  }
  const Eigen::Vector2d cop(balance.cop[0], balance.cop[1]);
  const std::string at =
      fmt::format("CoP ({:.1f}, {:.1f}) mm", Tenths(kMilli * cop.x()), Tenths(kMilli * cop.y()));
  const auto corners = std::clamp<size_t>(balance.num_corners, 0, std::size(balance.corner_x));
  if (balance.region != balance_torque_t::REGION_POLYGON || corners < 3) {
    return fmt::format("{}, limits ({:.1f}, {:.1f}) mm", at, kMilli * balance.cop_limit[0],
                       kMilli * balance.cop_limit[1]);
  }
  std::array<Eigen::Vector2d, std::size(balance_torque_t{}.corner_x)> corner;
  for (size_t i = 0; i < corners; ++i) corner[i] = {balance.corner_x[i], balance.corner_y[i]};
  const double inside = balance::SignedDistance(balance::ConvexHull({corner.data(), corners}), cop);
  return inside < 0 ? fmt::format("{}, {:.1f} mm outside the soles' region", at, -kMilli * inside)
                    : fmt::format("{}, at the edge of the soles' region", at);
}

void AddBalancing(const RunRecord& run, EventList* events) {
  for (const auto& [axis, name] : {std::pair{0, "x"}, std::pair{1, "y"}}) {
    const auto on = [&, a = axis](int64_t tick) -> std::optional<bool> {
      const balance_torque_t* balance = run.balance.at(tick);
      if (balance == nullptr) return {};
      return (a == 0 ? balance->active_x : balance->active_y) != 0;
    };
    const std::vector<Interval> intervals = Intervals(run, on);
    for (const Interval& interval : intervals) {
      const balance_torque_t* balance = run.balance.at(interval.begin);
      events->Add(interval.begin, "balancing_on",
                  fmt::format("{}: CoP of the task torque {:.1f} mm, limit {:.1f} mm", name,
                              kMilli * balance->cop_task[axis], kMilli * balance->cop_limit[axis]));
      events->AddEndOf(interval, "balancing_off", name);
    }
  }
  const auto not_achieved = [&](int64_t tick) -> std::optional<bool> {
    const balance_torque_t* balance = run.balance.at(tick);
    if (balance == nullptr) return {};
    return balance->status == balance_torque_t::STATUS_NOT_ACHIEVED;
  };
  events->AddIntervals(Intervals(run, not_achieved), "cop_not_achieved_begins",
                       "cop_not_achieved_ends",
                       [&](int64_t tick) { return NotAchievedText(*run.balance.at(tick)); });
  const auto infeasible = [&](int64_t tick) -> std::optional<bool> {
    const joint_command_t* command = run.command.at(tick);
    if (command == nullptr || !TellsRatio(*command)) return {};
    return command->eta_feasible == 0;
  };
  events->AddIntervals(Intervals(run, infeasible), "eta_infeasible_begins", "eta_infeasible_ends",
                       [&](int64_t tick) {
                         return fmt::format("no ratio meets all conditions; eta {:.3f}",
                                            run.command.at(tick)->eta);
                       });
}

/// The robot walks, and the capture point is within the sole that carries, the planned foothold and
/// what lies between: the step that is needed is the one under way.
bool WalksThere(const RunRecord& run, const support_plan_t& plan) {
  if (plan.stepping == support_plan_t::STEPPING_NONE || plan.step_foot < 0 || plan.step_foot > 1 ||
      plan.step_reason != support_plan_t::REASON_WALK) {
    return false;
  }
  const auto foot = static_cast<size_t>(plan.step_foot);
  const Eigen::Isometry3d stance = GetPose(plan.foot_pose[1 - foot]);
  // The foothold's heading is not told: it is nearly the stance foot's.
  Eigen::Isometry3d foothold = stance;
  foothold.translation() = GetVector3(plan.foothold);
  std::array<Eigen::Vector2d, balance::ConvexPolygon::kMaxCorners> points;
  size_t count = 0;
  for (const auto& [pose, sole] : {std::pair{stance, 1 - foot}, std::pair{foothold, foot}}) {
    const balance::ConvexPolygon polygon = balance::SolePolygon(run.robot.feet()[sole], 0);
    for (const Eigen::Vector2d& corner : polygon.corners()) {
      if (count == points.size()) break;
      points[count++] = (pose * Eigen::Vector3d(corner.x(), corner.y(), 0)).head<2>();
    }
  }
  const Eigen::Vector2d point(plan.capture_point[0], plan.capture_point[1]);
  return balance::SignedDistance(balance::ConvexHull({points.data(), count}), point) > -kStrays;
}

void AddCapturePoint(const RunRecord& run, EventList* events) {
  const auto needed = [&](int64_t tick) -> std::optional<bool> {
    const support_plan_t* plan = run.plan.at(tick);
    if (plan == nullptr) return {};
    return plan->step_needed != 0 && !WalksThere(run, *plan);
  };
  const std::vector<Interval> intervals = Intervals(run, needed);
  for (const Interval& interval : intervals) {
    const support_plan_t& plan = *run.plan.at(interval.begin);
    events->Add(interval.begin, "step_needed",
                fmt::format("a foot at ({:.2f}, {:.2f}) m within {:.2f} s; capture point {:.1f} mm "
                            "beyond the soles",
                            plan.step_position[0], plan.step_position[1], plan.step_time,
                            -kMilli * plan.capture_margin));
    events->AddEndOf(interval, "step_needed_ends", "capture point inside the soles again");
  }
}

/// "107.8 mm inside the soles".
std::string Inside(double margin) {
  const double tenths = Tenths(kMilli * margin);
  return fmt::format("{:.1f} mm {} the soles", std::abs(tenths), tenths < 0 ? "outside" : "inside");
}

void AddSteps(const RunRecord& run, EventList* events) {
  for (const PlannerStep& step : PlannerSteps(run)) {
    const std::string foot = FootName(run, step.foot);
    // A walk's foot is unloaded before its touch-down is timed.
    const std::string in_time =
        step.planned_time > 0 ? fmt::format(" in {:.2f} s", step.planned_time) : std::string();
    events->Add(step.begin, "step_begins",
                fmt::format("{} to ({:.2f}, {:.2f}) m{}: {}", foot, step.planned.x(),
                            step.planned.y(), in_time, StepReason(step.reason)));
    if (!step.landing) continue;
    // A walk plans no capture point.
    const bool catches = step.reason != support_plan_t::REASON_WALK &&
                         step.reason != support_plan_t::REASON_TOGETHER;
    events->Add(
        *step.landing, "step_lands",
        fmt::format("{} at ({:.2f}, {:.2f}) m, {:.0f} mm from its last foothold, {:.0f} mm "
                    "from where it stood (planned at first {:.0f} mm); capture point {}{}",
                    foot, step.landed.x(), step.landed.y(),
                    kMilli * (step.landed - step.foothold).norm(),
                    kMilli * (step.landed - step.from).norm(),
                    kMilli * (step.planned - step.from).norm(), Inside(step.margin),
                    catches ? fmt::format(" (planned {})", Inside(step.planned_margin)) : ""));
  }
  int8_t before = support_plan_t::STEPPING_NONE;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const support_plan_t* plan = run.plan.at(tick);
    if (plan == nullptr) continue;
    if (before != support_plan_t::STEPPING_NONE &&
        plan->stepping == support_plan_t::STEPPING_NONE) {
      events->Add(tick, "step_rests", "the COM is at rest between the feet");
    }
    before = plan->stepping;
  }
}

void AddBridge(const RunRecord& run, EventList* events) {
  const ElementNames names(run.robot);
  const bridge_status_t* before = nullptr;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const bridge_status_t* bridge = run.bridge.at(tick);
    if (bridge == nullptr) continue;
    if (before != nullptr && bridge->state != before->state) {
      const std::string reason = BridgeReasonText(*bridge, names);
      events->Add(tick, "bridge_state",
                  fmt::format("{} to {}{}", BridgeStateName(before->state),
                              BridgeStateName(bridge->state), reason.empty() ? "" : ": " + reason));
    }
    before = bridge;
  }
}

/// A limit of the bridge that changed what a controller wanted of a joint.
struct MotorLimit {
  int bit;
  const char *begins, *ends;
};
constexpr MotorLimit kMotorLimits[] = {
    {bridge_status_t::LIMIT_TORQUE, "motor_limited", "motor_limited_ends"},
    {bridge_status_t::LIMIT_THERMAL, "motor_hot", "motor_hot_ends"},
    {bridge_status_t::LIMIT_IMPEDANCE, "impedance_cut", "impedance_cut_ends"},
};

/// N·m that the command wants of a joint, with its stiffness and damping at the estimated joint.
Answer WantedTorque(const RunRecord& run, int64_t tick, size_t joint) {
  const joint_command_t* const command = run.command.at(tick);
  const robot_state_t* const state = run.state.at(tick);
  if (command == nullptr || joint >= command->torque.size()) return {};
  if (command->stiffness[joint] == 0 && command->damping[joint] == 0) return command->torque[joint];
  if (state == nullptr) return {};
  return command->torque[joint] +
         command->stiffness[joint] * (command->position[joint] - state->joint_position[joint]) +
         command->damping[joint] * (command->velocity[joint] - state->joint_velocity[joint]);
}

/// "left_ankle_pitch: 12.7 to 7.5 N·m, of 14.1 N·m wanted", over the interval.
std::string LimitedText(const RunRecord& run, size_t joint, const MotorLimit& limit,
                        const Interval& interval) {
  const std::string& name = run.robot.joints()[joint].name;
  if (limit.bit == bridge_status_t::LIMIT_IMPEDANCE) {
    return fmt::format("{}: stiffness, damping, position or velocity cut to what the robot bears",
                       name);
  }
  const auto applied = [&](int64_t tick) -> Answer {
    const bridge_status_t* const bridge = run.bridge.at(tick);
    if (bridge == nullptr) return {};
    return bridge->applied_torque[joint];
  };
  double from = applied(interval.begin - 1).value_or(*applied(interval.begin)), to = from;
  Answer wanted;
  for (int64_t tick = interval.begin; tick < interval.end.value_or(run.num_ticks); ++tick) {
    const bridge_status_t* const bridge = run.bridge.at(tick);
    if (bridge == nullptr || (bridge->saturated[joint] & limit.bit) == 0) continue;
    const double now = bridge->applied_torque[joint];
    // A cold motor is held at its largest torque, a hot one to ever less.
    const bool more = limit.bit == bridge_status_t::LIMIT_TORQUE
                          ? std::abs(now) >= std::abs(to) || tick == interval.begin
                          : std::abs(now) <= std::abs(to) || tick == interval.begin;
    if (more) to = now;
    const Answer want = WantedTorque(run, tick, joint);
    if (want && (!wanted || std::abs(*want) > std::abs(*wanted))) wanted = want;
  }
  return fmt::format("{}: {:.1f} to {:.1f} N·m{}", name, Tenths(from), Tenths(to),
                     wanted ? fmt::format(", of {:.1f} N·m wanted", Tenths(*wanted)) : "");
}

void AddMotors(const RunRecord& run, EventList* events) {
  const size_t joints = run.robot.joints().size();
  const auto gap = static_cast<int64_t>(std::ceil(kLimitGap / run.spec.tick_period()));
  std::array<std::vector<std::vector<Interval>>, std::size(kMotorLimits)> limited;
  limited.fill(std::vector<std::vector<Interval>>(joints));
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const bridge_status_t* const bridge = run.bridge.at(tick);
    if (bridge == nullptr || bridge->state != bridge_status_t::STATE_RUNNING) continue;
    for (size_t joint = 0; joint < joints; ++joint) {
      if (bridge->saturated[joint] == 0) continue;
      for (size_t i = 0; i < limited.size(); ++i) {
        if ((bridge->saturated[joint] & kMotorLimits[i].bit) == 0) continue;
        std::vector<Interval>& intervals = limited[i][joint];
        if (intervals.empty() || tick - *intervals.back().end > gap)
          intervals.push_back({tick, {}});
        intervals.back().end = tick + 1;
      }
    }
  }
  for (size_t i = 0; i < limited.size(); ++i) {
    const MotorLimit& limit = kMotorLimits[i];
    for (size_t joint = 0; joint < joints; ++joint) {
      for (Interval& interval : limited[i][joint]) {
        if (*interval.end == run.num_ticks) interval.end.reset();
        events->Add(interval.begin, limit.begins, LimitedText(run, joint, limit, interval));
        events->AddEndOf(interval, limit.ends, run.robot.joints()[joint].name);
      }
    }
  }
}

/// A loaded sole whose true centre of pressure is at its edge: it tips, whatever was computed.
void AddSoles(const RunRecord& run, EventList* events) {
  const double least = kTipsShare * run.robot.total_mass() * robot::kGravity;
  const auto gap = static_cast<int64_t>(std::ceil(kTipsGap / run.spec.tick_period()));
  for (size_t foot = 0; foot < 2; ++foot) {
    const balance::ConvexPolygon sole = balance::SolePolygon(run.robot.feet()[foot], 0);
    const auto tips = [&](int64_t tick) -> std::optional<bool> {
      const ground_truth_t* const truth = run.truth.at(tick);
      if (truth == nullptr) return {};
      const balance::Vector6d wrench = GetWrench(truth->foot_wrench[foot]);
      if (truth->fallen != 0 || -wrench[2] < least) return false;
      return balance::SignedDistance(sole, balance::CenterOfPressure(wrench)) < kTipsDistance;
    };
    std::vector<Interval> intervals = Intervals(run, tips, gap);
    std::erase_if(intervals, [&](const Interval& i) {
      return run.duration(i.end.value_or(run.num_ticks) - i.begin) < kLeastTipping;
    });
    events->AddIntervals(intervals, "sole_on_edge", "sole_on_edge_ends", [&](int64_t tick) {
      return fmt::format("{}, which carried {:.0f} N", FootName(run, foot),
                         -run.truth.at(tick)->foot_wrench[foot].force[2]);
    });
  }
}

Answer PushForce(const RunRecord& run, int64_t tick) {
  const external_push_t* push = run.push.at(tick);
  if (push == nullptr) return {};
  return GetVector3(push->force).norm();
}

/// N, below which a reading is noise: the sensor's deviation from the record itself, by the median
/// difference between neighbouring samples, which a push does not touch.
double PushThreshold(const RunRecord& run) {
  constexpr double kDeviations = 6;  // of a norm of three: beyond it once in 10^7 samples
  // The norm of three normal variables of deviation 1 has this median; a difference of two, √2 of
  // it.
  const double median_of_difference = 1.5382 * std::sqrt(2.0);
  std::vector<double> differences;
  for (int64_t tick = 1; tick < run.num_ticks; ++tick) {
    const external_push_t* before = run.push.at(tick - 1);
    const external_push_t* now = run.push.at(tick);
    if (before == nullptr || now == nullptr) continue;
    differences.push_back((GetVector3(now->force) - GetVector3(before->force)).norm());
  }
  if (differences.empty()) return 0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return kDeviations * *middle / median_of_difference;
}

void AddPush(const RunRecord& run, bool ended, EventList* events) {
  const double threshold = PushThreshold(run);
  const auto pushed = [&](int64_t tick) -> std::optional<bool> {
    const Answer force = PushForce(run, tick);
    if (!force) return {};
    return *force > threshold;
  };
  const auto gap = static_cast<int64_t>(std::ceil(kPushGap / run.spec.tick_period()));
  for (const Interval& interval : Intervals(run, pushed, gap)) {
    int64_t peak = interval.begin;
    for (int64_t tick = peak; tick < interval.end.value_or(run.num_ticks); ++tick) {
      if (PushForce(run, tick).value_or(0) > *PushForce(run, peak)) peak = tick;
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
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const ground_truth_t* truth = run.truth.at(tick);
    if (truth == nullptr) continue;
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
  AddPhases(run, &events);
  AddSupport(run, &events);
  AddTransitions(run, &events);
  AddWaiting(run, &events);
  AddFeet(run, ended, &events);
  AddFootSensors(run, &events);
  AddCalibration(run, &events);
  AddBalancing(run, &events);
  AddCapturePoint(run, &events);
  AddSteps(run, &events);
  AddMotors(run, &events);
  AddSoles(run, &events);
  AddBridge(run, &events);
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
