// The orientation of a link.
#include "components/balance/tasks/frame_kinematics.h"
#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

using Eigen::Vector3d;

class OrientationTask : public Task {
 public:
  OrientationTask(robot::Frame frame, std::vector<int> rows)
      : frame_(std::move(frame)), rows_(std::move(rows)) {}

  int num_rows() const override { return static_cast<int>(rows_.size()); }
  TargetParts needs() const override { return {.rotation = true}; }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    const robot::RobotData& data = state.data;
    const auto b = static_cast<size_t>(frame_.body);
    const Vector3d error = OrientationError(target.rotation, Rotation(data));
    const Vector3d velocity_error = target.angular_velocity - data.body_angular_velocity[b];
    for (const int joint : state.model.supporting_joints(frame_.body)) {
      CopySelected(rows_, data.joint_axis[static_cast<size_t>(joint)],
                   rows->jacobian.col(6 + joint));
    }
    for (int i = 0; i < num_rows(); ++i) {
      const int axis = rows_[static_cast<size_t>(i)];
      rows->jacobian(i, 3 + axis) = 1;
      rows->bias_acceleration[i] = data.body_angular_bias[b][axis];
      rows->acceleration[i] = PdAcceleration(gains(), target.angular_acceleration[axis],
                                             error[axis], velocity_error[axis]);
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    target->rotation = Rotation(state.data);
    target->angular_velocity.setZero();
    target->angular_acceleration.setZero();
  }

 private:
  Eigen::Matrix3d Rotation(const robot::RobotData& data) const {
    return data.body_rotation[static_cast<size_t>(frame_.body)] * frame_.pose.linear();
  }

  robot::Frame frame_;
  std::vector<int> rows_;
};

}  // namespace

std::unique_ptr<Task> MakeOrientationTask(const TaskSpec& spec, const robot::RobotModel& model) {
  RefusePoint(spec);
  RefuseJoints(spec);
  return std::make_unique<OrientationTask>(TaskFrame(spec, model),
                                           SelectedRows(spec.axes, kTurnX, 3));
}

}  // namespace poise::balance
