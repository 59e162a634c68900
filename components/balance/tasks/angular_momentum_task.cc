// The angular momentum about the COM. It has no position to return to: of the gains k_d alone
// counts, by which an error decays (1/s).
#include "components/balance/tasks/centroidal_momentum.h"
#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

using Eigen::Vector3d;

class AngularMomentumTask : public Task {
 public:
  AngularMomentumTask(std::vector<int> rows, int num_velocities)
      : rows_(std::move(rows)), jacobian_(Eigen::MatrixXd::Zero(3, num_velocities)) {}

  int num_rows() const override { return static_cast<int>(rows_.size()); }
  TargetParts needs() const override { return {.angular_momentum = true}; }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    Vector3d bias;
    ComputeAngularMomentumRows(state.data, jacobian_, &bias);
    const Vector3d error = target.angular_momentum - AngularMomentum(state.state, state.data);
    for (int i = 0; i < num_rows(); ++i) {
      const int axis = rows_[static_cast<size_t>(i)];
      rows->jacobian.row(i) = jacobian_.row(axis);
      rows->bias_acceleration[i] = bias[axis];
      rows->acceleration[i] =
          PdAcceleration(gains(), target.angular_momentum_rate[axis], 0, error[axis]);
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    target->angular_momentum = AngularMomentum(state.state, state.data);
    target->angular_momentum_rate.setZero();
  }

 private:
  std::vector<int> rows_;
  mutable Eigen::MatrixXd jacobian_;  // scratch, 3×n
};

}  // namespace

std::unique_ptr<Task> MakeAngularMomentumTask(const TaskSpec& spec,
                                              const robot::RobotModel& model) {
  RefuseFrame(spec);
  RefuseJoints(spec);
  return std::make_unique<AngularMomentumTask>(SelectedRows(spec.axes, kTurnX, 3),
                                               model.num_velocities());
}

}  // namespace poise::balance
