// The position of some joints, or of all.
#include <fmt/format.h>

#include <stdexcept>

#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

class JointPostureTask : public Task {
 public:
  explicit JointPostureTask(std::vector<int> joints) : joints_(std::move(joints)) {}

  int num_rows() const override { return static_cast<int>(joints_.size()); }
  TargetParts needs() const override { return {.joints = true}; }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    for (int i = 0; i < num_rows(); ++i) {
      const int joint = joints_[static_cast<size_t>(i)];
      rows->jacobian(i, 6 + joint) = 1;
      rows->bias_acceleration[i] = 0;
      rows->acceleration[i] = PdAcceleration(
          gains(), 0, target.joint_position[joint] - state.state.joint_position[joint],
          -state.state.joint_velocity[joint]);
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    target->joint_position = state.state.joint_position;
  }

 private:
  std::vector<int> joints_;
};

}  // namespace

std::unique_ptr<Task> MakeJointPostureTask(const TaskSpec& spec, const robot::RobotModel& model) {
  SelectedRows(spec.axes, 0, 0);
  RefuseFrame(spec);
  std::vector<int> joints;
  for (const std::string& name : spec.joints) {
    joints.push_back(model.FindJoint(name));
    if (joints.back() < 0) {
      throw std::invalid_argument(
          fmt::format("joint: robot '{}' has no joint '{}'", model.name(), name));
    }
  }
  for (int j = 0; spec.joints.empty() && j < model.num_joints(); ++j) joints.push_back(j);
  return std::make_unique<JointPostureTask>(std::move(joints));
}

}  // namespace poise::balance
