#include <algorithm>
#include <cmath>

#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

/// Over ticks and joints.
Answer MaximumOverJoints(const RunRecord& run,
                         const std::function<Answer(int64_t tick, size_t joint)>& value) {
  return Maximum(run, [&](int64_t tick) {
    Answer largest;
    for (size_t joint = 0; joint < run.robot.joints().size(); ++joint) {
      const Answer v = value(tick, joint);
      if (v && (!largest || *v > *largest)) largest = v;
    }
    return largest;
  });
}

Answer TorqueStepAtSwitch(const RunRecord& run) {
  Answer largest;
  for (const SupportChange& change : SupportChanges(run)) {
    if (change.tick < run.first_tick) continue;
    largest = std::max(largest.value_or(0), change.torque_step);
  }
  return largest;
}

/// None while the bridge does not follow: what a controller asks of a robot that has stopped moves
/// nobody.
const joint_command_t* FollowedCommand(const RunRecord& run, int64_t tick) {
  const bridge_status_t* bridge = run.bridge.at(tick);
  const bool stopped = bridge != nullptr && bridge->state > bridge_status_t::STATE_RUNNING;
  return stopped ? nullptr : run.command.at(tick);
}

}  // namespace

void AddTorques(MetricList* list) {
  list->push_back({"joint_torque_max", "N·m",
                   "largest joint torque commanded while the bridge follows",
                   [](const RunRecord& run) {
                     return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
                       const joint_command_t* command = FollowedCommand(run, t);
                       if (command == nullptr) return {};
                       return std::abs(command->torque[joint]);
                     });
                   }});
  list->push_back({"joint_torque_share", "%",
                   "largest joint torque commanded while the bridge follows, of its limit",
                   [](const RunRecord& run) {
                     return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
                       const joint_command_t* command = FollowedCommand(run, t);
                       if (command == nullptr) return {};
                       return 100 * std::abs(command->torque[joint]) / JointTorqueLimit(run, joint);
                     });
                   }});
  list->push_back({"torque_step_max", "N·m",
                   "largest change of a joint's command in one tick while the bridge follows",
                   [](const RunRecord& run) {
                     return MaximumOverJoints(run, [&](int64_t t, size_t joint) -> Answer {
                       const joint_command_t* now = FollowedCommand(run, t);
                       const joint_command_t* before = FollowedCommand(run, t - 1);
                       if (now == nullptr || before == nullptr) return {};
                       return std::abs(now->torque[joint] - before->torque[joint]);
                     });
                   }});
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
  list->push_back({"saturations", "", "joint-ticks in which the bridge limited the torque",
                   [](const RunRecord& run) {
                     return Maximum(run, [&](int64_t t) -> Answer {
                       const bridge_status_t* bridge = run.bridge.at(t);
                       if (bridge == nullptr) return {};
                       return static_cast<double>(bridge->saturations);
                     });
                   }});
  list->push_back({"bridge_not_running_ticks", "",
                   "ticks in which the bridge was damping, stopping or stopped",
                   [](const RunRecord& run) {
                     return CountTicks(run, [&](int64_t t) -> std::optional<bool> {
                       const bridge_status_t* bridge = run.bridge.at(t);
                       if (bridge == nullptr) return {};
                       return bridge->state > bridge_status_t::STATE_RUNNING;
                     });
                   }});
}

}  // namespace poise::logging
