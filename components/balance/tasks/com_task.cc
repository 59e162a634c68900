// The COM's position.
#include "components/balance/tasks/task.h"

namespace poise::balance {
namespace {

class ComTask : public Task {
 public:
  explicit ComTask(std::vector<int> rows) : rows_(std::move(rows)) {}

  int num_rows() const override { return static_cast<int>(rows_.size()); }
  TargetParts needs() const override { return {.position = true}; }

  void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const override {
    const robot::RobotData& data = state.data;
    CopySelected(rows_, data.com_jacobian, rows->jacobian);
    for (int i = 0; i < num_rows(); ++i) {
      const int axis = rows_[static_cast<size_t>(i)];
      rows->bias_acceleration[i] = data.com_bias_acceleration[axis];
      const bool follows = !target.accelerates_only || axis == kZ;
      rows->acceleration[i] = follows
                                  ? PdAcceleration(gains(), target.acceleration[axis],
                                                   target.position[axis] - data.com[axis],
                                                   target.velocity[axis] - data.com_velocity[axis])
                                  : target.acceleration[axis];
    }
  }

  void Hold(const TaskState& state, TaskTarget* target) const override {
    target->position = state.data.com;
    target->velocity.setZero();
    target->acceleration.setZero();
    target->accelerates_only = false;
  }

 private:
  std::vector<int> rows_;
};

}  // namespace

std::unique_ptr<Task> MakeComTask(const TaskSpec& spec, const robot::RobotModel&) {
  RefuseFrame(spec);
  RefuseJoints(spec);
  return std::make_unique<ComTask>(SelectedRows(spec.axes, kX, 3));
}

}  // namespace poise::balance
