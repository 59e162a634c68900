#include "components/redistributor/shared_impedance.h"

#include <algorithm>

namespace poise {
namespace {

// Chosen, not fitted: half of the delay that they are for, and soft beside the tasks' gains.
constexpr double kRotorTime = 3e-3;     // s
constexpr double kStiffnessTime = 0.1;  // s

}  // namespace

PlannedImpedance::PlannedImpedance(const SharedImpedance& config, const robot::RobotModel& model,
                                   double period) {
  if (!config.enabled()) return;
  horizon_ = model.drive_train().sensor_delay + period / 2;
  const double rotor_time = config.has_rotor_time() ? config.rotor_time() : kRotorTime;
  for (const robot::MotorModel& motor : model.motors()) {
    damping_.push_back(motor.reflected_inertia / rotor_time);
    stiffness_.push_back(damping_.back() / kStiffnessTime);
  }
}

void PlannedImpedance::Plan(const robot::RobotState& state,
                            const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                            joint_command_t* command) const {
  for (size_t i = 0; i < damping_.size(); ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    const double gain = horizon_ * acceleration[j];
    command->velocity[i] = state.joint_velocity[j] + gain;
    command->position[i] =
        state.joint_position[j] + horizon_ * (state.joint_velocity[j] + gain / 2);
    command->stiffness[i] = stiffness_[i];
    command->damping[i] = damping_[i];
  }
}

void ClearImpedance(joint_command_t* command) {
  for (std::vector<double>* values :
       {&command->position, &command->velocity, &command->stiffness, &command->damping}) {
    std::fill(values->begin(), values->end(), 0.0);
  }
}

}  // namespace poise
