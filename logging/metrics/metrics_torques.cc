#include <algorithm>
#include <cmath>

#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

/// Adds the largest value over ticks and joints, and the joint that has it. `value` of a run, a
/// tick and a joint.
template <class Value>
void AddLargestOfJoints(MetricList* list, const char* name, const char* unit, const char* text,
                        const Value& value) {
  const auto largest = [value](const RunRecord& run, size_t* of) {
    Answer found;
    for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
      for (size_t joint = 0; joint < run.robot.joints().size(); ++joint) {
        const Answer v = value(run, tick, joint);
        if (!v || (found && *v <= *found)) continue;
        found = v;
        *of = joint;
      }
    }
    return found;
  };
  list->Add(name, unit, text, [largest](const RunRecord& run) {
    size_t joint = 0;
    return largest(run, &joint);
  });
  list->back().joint = [largest](const RunRecord& run) -> std::string {
    size_t joint = 0;
    return largest(run, &joint) ? run.robot.joints()[joint].name : "";
  };
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

/// N·m, size of what a joint's motor gave. None while the bridge does not follow.
Answer Torque(const RunRecord& run, int64_t tick, size_t joint) {
  if (Stopped(run, tick)) return {};
  const Answer torque = MotorTorque(run, joint, tick);
  return torque ? Answer(std::abs(*torque)) : torque;
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
  const Answer velocity =
      OfJoint<&ground_truth_t::joint_velocity, &robot_state_t::joint_velocity>(run, tick, joint);
  if (!(limit > 0) || !velocity) return {};
  return std::abs(*velocity * (100 / limit));
}

/// N·m, in one tick.
Answer TorqueChange(const RunRecord& run, int64_t tick, size_t joint) {
  if (Stopped(run, tick) || Stopped(run, tick - 1)) return {};
  const Answer now = MotorTorque(run, joint, tick), before = MotorTorque(run, joint, tick - 1);
  if (!now || !before) return {};
  return std::abs(*now - *before);
}

Answer TorqueLimited(const RunRecord& run) {
  constexpr int kLimits = bridge_status_t::LIMIT_TORQUE | bridge_status_t::LIMIT_THERMAL;
  Answer count;
  for (const auto& [t, bridge] : Messages(run.bridge, run.first_tick, run.num_ticks)) {
    const auto limited =
        std::ranges::count_if(bridge->saturated, [](int8_t bits) { return (bits & kLimits) != 0; });
    count = count.value_or(0) + static_cast<double>(limited);
  }
  return count;
}

}  // namespace

void AddTorques(MetricList* list) {
  AddLargestOfJoints(list, "joint_torque_max", "N·m",
                     "largest torque of a joint's motor while the bridge follows", Torque);
  AddLargestOfJoints(list, "joint_torque_share", "%",
                     "largest torque of a joint's motor while the bridge follows, of its limit",
                     [](const RunRecord& run, int64_t t, size_t joint) -> Answer {
                       const Answer torque = Torque(run, t, joint);
                       if (!torque) return {};
                       return 100 * *torque / robot::PeakTorque(run.robot, joint);
                     });
  AddLargestOfJoints(list, "joint_position_beyond", "rad",
                     "largest distance of a joint beyond its limit of position while the bridge "
                     "follows; negative: no joint was nearer to one",
                     PositionBeyond);
  AddLargestOfJoints(list, "joint_velocity_share", "%",
                     "largest joint velocity while the bridge follows, of its limit",
                     VelocityShare);
  AddLargestOfJoints(
      list, "torque_step_max", "N·m",
      "largest change of the torque of a joint's motor in one tick while the bridge follows",
      TorqueChange);
  const std::string step =
      "largest change of a joint's command in a tick in which the support changes";
  list->Add("torque_step_at_switch", "N·m", step, TorqueStepAtSwitch);
  list->Add("torque_step_at_switch_reference", "N·m", step + ", reference run",
            OfReference(TorqueStepAtSwitch));
  list->Add("torque_step_ratio", "%", step + ", of the reference run's",
            [](const RunRecord& run) -> Answer {
              const Answer here = TorqueStepAtSwitch(run);
              const Answer there = OfReference(TorqueStepAtSwitch)(run);
              if (!here || !there || *there <= 0) return {};
              return 100 * *here / *there;
            });
  list->Add("torque_limited", "",
            "joint-ticks in which a motor's largest torque, or a hot one's rated current, was less "
            "than wanted",
            TorqueLimited);
  list->Add("saturations", "",
            "joint-ticks in which the bridge changed what a joint was to do: torque (largest, "
            "slew, heat, end of the range) or impedance",
            Largest(Of(&RunRecord::bridge, [](const auto& bridge) {
              return static_cast<double>(bridge.saturations);
            })));
  list->Add("bridge_not_running_ticks", "",
            "ticks in which the bridge was damping, stopping or stopped",
            TicksOf(Of(&RunRecord::bridge, [](const auto& bridge) {
              return bridge.state > bridge_status_t::STATE_RUNNING;
            })));
}

}  // namespace poise::logging
