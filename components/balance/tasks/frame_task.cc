// The pose of a frame, or of a point of it: a free foot, a hand, a head. The soles' own motion is
// part of a robot's data already.
#include "components/balance/tasks/frame_kinematics.h"
#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

class FrameTask : public Task {
 public:
  /// `sole`: the foot whose sole's centre the frame is.
  FrameTask(robot::Frame frame, std::optional<robot::Foot> sole, std::vector<int> rows,
            int num_velocities)
      : frame_(std::move(frame)),
        sole_(sole),
        rows_(std::move(rows)),
        jacobian_(robot::Matrix6X::Zero(6, num_velocities)) {}

  int num_rows() const override { return static_cast<int>(rows_.size()); }
  TargetParts needs() const override {
    return {.position = rows_.front() < 3, .rotation = rows_.back() >= 3};
  }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    FrameMotion motion = Motion(state);
    if (sole_) {
      // Late, a thrown leg's velocities say that its foot rises: damping would push it down.
      motion.velocity.head<3>() +=
          state.sole_delay * (target.acceleration - motion.bias_acceleration.head<3>());
      CopySelected(rows_, state.data.foot_jacobian[*sole_], rows->jacobian);
    } else {
      FillFrameJacobian(state.model, state.data, frame_, jacobian_);
      CopySelected(rows_, jacobian_, rows->jacobian);
    }
    robot::Vector6d error, velocity, acceleration;
    error << target.position - motion.pose.translation(),
        OrientationError(target.rotation, motion.pose.linear());
    velocity << target.velocity, target.angular_velocity;
    acceleration << target.acceleration, target.angular_acceleration;
    for (int i = 0; i < num_rows(); ++i) {
      const int axis = rows_[static_cast<size_t>(i)];
      rows->bias_acceleration[i] = motion.bias_acceleration[axis];
      rows->acceleration[i] = PdAcceleration(gains(), acceleration[axis], error[axis],
                                             velocity[axis] - motion.velocity[axis]);
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    const FrameMotion motion = Motion(state);
    target->position = motion.pose.translation();
    target->rotation = motion.pose.linear();
    for (auto* rest : {&target->velocity, &target->acceleration, &target->angular_velocity,
                       &target->angular_acceleration}) {
      rest->setZero();
    }
  }

 private:
  FrameMotion Motion(const TaskState& state) const {
    if (!sole_) return ComputeFrameMotion(state.data, frame_);
    return {state.data.foot_pose[*sole_], state.data.foot_velocity[*sole_],
            state.data.foot_bias_acceleration[*sole_]};
  }

  robot::Frame frame_;
  std::optional<robot::Foot> sole_;
  std::vector<int> rows_;
  // Scratch; columns of joints that do not carry the frame stay 0.
  mutable robot::Matrix6X jacobian_;
};

}  // namespace

std::unique_ptr<Task> MakeFrameTask(const TaskSpec& spec, const robot::RobotModel& model) {
  RefuseJoints(spec);
  const auto sole = spec.point.isZero(0) ? spec.foot : std::nullopt;
  return std::make_unique<FrameTask>(TaskFrame(spec, model), sole, SelectedRows(spec.axes, kX, 6),
                                     model.num_velocities());
}

}  // namespace poise::balance
