#include <algorithm>
#include <cmath>

#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

using JointValue = std::function<Answer(const RunRecord& run, int64_t tick, size_t joint)>;

/// The largest value over ticks and joints. `of`: the joint that has it.
Answer MaximumOverJoints(const RunRecord& run, const JointValue& value, size_t* of = nullptr) {
  Answer largest;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    for (size_t joint = 0; joint < run.robot.joints().size(); ++joint) {
      const Answer v = value(run, tick, joint);
      if (!v || (largest && *v <= *largest)) continue;
      largest = v;
      if (of != nullptr) *of = joint;
    }
  }
  return largest;
}

Metric LargestOfJoints(const char* name, const char* unit, const char* description,
                       const JointValue& value) {
  Metric metric{name, unit, description,
                [value](const RunRecord& run) { return MaximumOverJoints(run, value); }};
  metric.joint = [value](const RunRecord& run) -> std::string {
    size_t joint = 0;
    return MaximumOverJoints(run, value, &joint) ? run.robot.joints()[joint].name : "";
  };
  return metric;
}

Answer TorqueStepAtSwitch(const RunRecord& run) {
  Answer largest;
  for (const SupportChange& change : SupportChanges(run)) {
    if (change.tick < run.first_tick) continue;
    largest = std::max(largest.value_or(0), change.torque_step);
  }
  return largest;
}

/// What a controller asks of a robot that has stopped moves nobody.
bool Stopped(const RunRecord& run, int64_t tick) {
  const bridge_status_t* bridge = run.bridge.at(tick);
  return bridge != nullptr && bridge->state > bridge_status_t::STATE_RUNNING;
}

/// N·m that a joint's motor gave. None while the bridge does not follow.
Answer Torque(const RunRecord& run, int64_t tick, size_t joint) {
  if (Stopped(run, tick)) return {};
  return MotorTorque(run, joint, tick);
}

/// The true positions or velocities, else the estimated ones; none while the bridge does not
/// follow.
template <auto kTrue, auto kEstimated>
Answer OfJoint(const RunRecord& run, int64_t tick, size_t joint) {
  if (Stopped(run, tick)) return {};
  if (const ground_truth_t* truth = run.truth.at(tick)) return (truth->*kTrue)[joint];
  if (const robot_state_t* state = run.state.at(tick)) return (state->*kEstimated)[joint];
  return {};
}

/// rad, negative inside.
Answer PositionBeyond(const RunRecord& run, int64_t tick, size_t joint) {
  const Answer q =
      OfJoint<&ground_truth_t::joint_position, &robot_state_t::joint_position>(run, tick, joint);
  if (!q) return {};
  const robot::Joint& of = run.robot.joints()[joint];
  return std::max(*q - of.upper, of.lower - *q);
}

/// %, none of a joint without a limit.
Answer VelocityShare(const RunRecord& run, int64_t tick, size_t joint) {
  const double limit = run.robot.joints()[joint].velocity_limit;
  if (!(limit > 0)) return {};
  return Scaled(
      OfJoint<&ground_truth_t::joint_velocity, &robot_state_t::joint_velocity>(run, tick, joint),
      100 / limit);
}

}  // namespace

void AddTorques(MetricList* list) {
  list->push_back(LargestOfJoints("joint_torque_max", "N·m",
                                  "largest torque of a joint's motor while the bridge follows",
                                  [](const RunRecord& run, int64_t t, size_t joint) -> Answer {
                                    const Answer torque = Torque(run, t, joint);
                                    return torque ? Answer(std::abs(*torque)) : torque;
                                  }));
  list->push_back(
      LargestOfJoints("joint_torque_share", "%",
                      "largest torque of a joint's motor while the bridge follows, of its limit",
                      [](const RunRecord& run, int64_t t, size_t joint) -> Answer {
                        const Answer torque = Torque(run, t, joint);
                        if (!torque) return {};
                        return 100 * std::abs(*torque) / robot::PeakTorque(run.robot, joint);
                      }));
  list->push_back(LargestOfJoints("joint_position_beyond", "rad",
                                  "largest distance of a joint beyond its limit of position while "
                                  "the bridge follows; negative: "
                                  "no joint was nearer to one",
                                  PositionBeyond));
  list->push_back(LargestOfJoints("joint_velocity_share", "%",
                                  "largest joint velocity while the bridge follows, of its limit",
                                  [](const RunRecord& run, int64_t t, size_t joint) -> Answer {
                                    const Answer share = VelocityShare(run, t, joint);
                                    return share ? Answer(std::abs(*share)) : share;
                                  }));
  list->push_back(LargestOfJoints(
      "torque_step_max", "N·m",
      "largest change of the torque of a joint's motor in one tick while the bridge follows",
      [](const RunRecord& run, int64_t t, size_t joint) -> Answer {
        const Answer now = Torque(run, t, joint), before = Torque(run, t - 1, joint);
        if (!now || !before) return {};
        return std::abs(*now - *before);
      }));
  list->push_back({"torque_step_at_switch", "N·m",
                   "largest change of a joint's command in a tick in which the support changes",
                   TorqueStepAtSwitch});
  list->push_back({"torque_step_at_switch_reference", "N·m",
                   "largest change of a joint's command in a tick in which the support changes, "
                   "reference run",
                   [](const RunRecord& run) { return OfReference(run, TorqueStepAtSwitch); }});
  list->push_back({"torque_step_ratio", "%",
                   "largest change of a joint's command in a tick in which the support changes, of "
                   "the reference run's",
                   [](const RunRecord& run) -> Answer {
                     const Answer here = TorqueStepAtSwitch(run);
                     const Answer there = OfReference(run, TorqueStepAtSwitch);
                     if (!here || !there || *there <= 0) return {};
                     return 100 * *here / *there;
                   }});
  list->push_back({"torque_limited", "",
                   "joint-ticks in which a motor's largest torque, or a hot one's rated current, "
                   "was less than wanted",
                   [](const RunRecord& run) -> Answer {
                     Answer count;
                     for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
                       const bridge_status_t* bridge = run.bridge.at(t);
                       if (bridge == nullptr) continue;
                       constexpr int kLimits =
                           bridge_status_t::LIMIT_TORQUE | bridge_status_t::LIMIT_THERMAL;
                       const auto limited = std::ranges::count_if(
                           bridge->saturated, [](int8_t bits) { return (bits & kLimits) != 0; });
                       count = count.value_or(0) + static_cast<double>(limited);
                     }
                     return count;
                   }});
  list->push_back(
      {"saturations", "",
       "joint-ticks in which the bridge changed what a joint was to do: torque (largest, "
       "slew, heat, end of the range) or impedance",
       [](const RunRecord& run) {
         return Maximum(run, OfTick(run.bridge, [](const bridge_status_t& bridge) {
                          return static_cast<double>(bridge.saturations);
                        }));
       }});
  list->push_back({"bridge_not_running_ticks", "",
                   "ticks in which the bridge was damping, stopping or stopped",
                   [](const RunRecord& run) {
                     return CountTicks(run, OfTick(run.bridge, [](const bridge_status_t& bridge) {
                                         return bridge.state > bridge_status_t::STATE_RUNNING;
                                       }));
                   }});
}

}  // namespace poise::logging
