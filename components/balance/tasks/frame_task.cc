// The pose of a frame, or of a point of it: a free foot, a hand, a head.
#include "components/balance/tasks/frame_kinematics.h"
#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

class FrameTask : public Task {
 public:
  FrameTask(robot::Frame frame, std::vector<int> rows, int num_velocities)
      : frame_(std::move(frame)),
        rows_(std::move(rows)),
        jacobian_(Eigen::MatrixXd::Zero(6, num_velocities)) {}

  int num_rows() const override { return static_cast<int>(rows_.size()); }
  TargetParts needs() const override {
    return {.position = rows_.front() < 3, .rotation = rows_.back() >= 3};
  }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    const FrameMotion motion = ComputeFrameMotion(state.data, frame_);
    FillFrameJacobian(state.model, state.data, frame_, jacobian_);
    robot::Vector6d error, velocity, acceleration;
    error << target.position - motion.pose.translation(),
        OrientationError(target.rotation, motion.pose.linear());
    velocity << target.velocity, target.angular_velocity;
    acceleration << target.acceleration, target.angular_acceleration;
    for (int i = 0; i < num_rows(); ++i) {
      const int axis = rows_[static_cast<size_t>(i)];
      rows->jacobian.row(i) = jacobian_.row(axis);
      rows->bias_acceleration[i] = motion.bias_acceleration[axis];
      rows->acceleration[i] = PdAcceleration(gains(), acceleration[axis], error[axis],
                                             velocity[axis] - motion.velocity[axis]);
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    const FrameMotion motion = ComputeFrameMotion(state.data, frame_);
    target->position = motion.pose.translation();
    target->rotation = motion.pose.linear();
    for (auto* rest : {&target->velocity, &target->acceleration, &target->angular_velocity,
                       &target->angular_acceleration}) {
      rest->setZero();
    }
  }

 private:
  robot::Frame frame_;
  std::vector<int> rows_;
  mutable Eigen::MatrixXd jacobian_;  // scratch; columns of joints that do not carry the frame stay 0
};

}  // namespace

std::unique_ptr<Task> MakeFrameTask(const TaskSpec& spec, const robot::RobotModel& model) {
  RefuseJoints(spec);
  return std::make_unique<FrameTask>(TaskFrame(spec, model), SelectedRows(spec.axes, kX, 6),
                                     model.num_velocities());
}

}  // namespace poise::balance
