#include "tools/robot/walking_loads.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/step_planner/legs/swing.h"
#include "components/step_planner/recovery_config.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using robot::RobotState;

constexpr int kSamples = 32;  // intervals of the time on one foot

/// A coordinate of the pendulum over the stance sole's origin, on one foot from −time/2 to time/2.
/// Half a support on both feet later, at a constant speed, it is `half` further along.
struct Orbit {
  double omega, amplitude;
  bool returns;  ///< comes back to the side from which it came: sideways

  Orbit(double omega, double single, double both, double half, bool returns)
      : omega(omega), returns(returns) {
    const double a = 0.5 * omega * single, b = 0.5 * omega * both;
    amplitude =
        half / (returns ? std::cosh(a) + b * std::sinh(a) : std::sinh(a) + b * std::cosh(a));
  }
  double At(double time) const {
    return amplitude * (returns ? std::cosh(omega * time) : std::sinh(omega * time));
  }
};

class Step {
 public:
  Step(const robot::RobotModel& model, const RobotState& stance)
      : model_(model),
        height_(robot::StandingHeight(model)),
        spec_(MakeRecoverySpec({}, {}, model, -1)),
        limits_(MakeStepChoice(model).limits()),
        nominal_(stance.joint_position) {}

  /// s. The other foot leaves as the landed one has half of the load.
  double both() const { return 0.5 * stepping::Recovery::kWalkLoadTime; }
  double single() const {
    return stepping::Recovery::kOmegaStepTime *
               std::sqrt((height_ - spec_.holding_lowering) / robot::kGravity) -
           both();
  }

  /// The robot on the sole of `stance`, whose frame lies at the origin, at each sample, with its
  /// velocities. Nothing where it is out of reach.
  std::optional<std::vector<RobotState>> States(robot::Foot stance) const {
    const double side = -Side(stance);
    const double period = single() + both(), length = kCheckedSpeed * period;
    const Vector3d across(0, side * limits_.spacing, 0), ahead(length, 0, 0);
    const double turn = side * 2 * kCheckedTurn * period;  // outwards in every second step
    stepping::Swing swing;
    PointMotion from;
    from.position = across - ahead;
    swing.Begin(from, Eigen::Matrix3d::Identity(), across + ahead,
                Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix(), 0, single(),
                stepping::Recovery::kSwing);
    const double com_height = height_ - spec_.holding_lowering;
    const double omega = std::sqrt(robot::kGravity / com_height);
    const Orbit sagittal(omega, single(), both(), 0.5 * length, false);
    const Orbit lateral(omega, single(), both(), 0.5 * limits_.spacing, true);
    std::vector<RobotState> states;
    robot::PostureGoal goal;
    goal.nominal = nominal_;
    for (int i = 0; i <= kSamples; ++i) {
      const double time = i * interval();
      const double middle = i * interval() - 0.5 * single();
      Eigen::Isometry3d& foot = goal.foot[Other(stance)];
      foot.translation() = swing.At(time).position;
      foot.linear() = swing.RotationAt(time).rotation;
      goal.foot[stance] = Eigen::Isometry3d::Identity();
      goal.com_xy = {sagittal.At(middle), side * lateral.At(middle)};
      goal.com_height = com_height;
      try {
        states.push_back(robot::SolvePosture(model_, goal));
      } catch (const robot::RobotError&) {
        return {};
      }
      goal.nominal = states.back().joint_position;
    }
    for (size_t i = 0; i < states.size(); ++i) {
      const RobotState &before = states[i == 0 ? 0 : i - 1],
                       &after = states[std::min(i + 1, states.size() - 1)];
      const double time = interval() * (i == 0 || i + 1 == states.size() ? 1 : 2);
      states[i].base_linear_velocity = (after.base_position - before.base_position) / time;
      states[i].joint_velocity = (after.joint_position - before.joint_position) / time;
    }
    return states;
  }

  /// N·m, of the motors: of the whole acceleration, on the sole of `stance` alone, as far as that
  /// has room for its centre of pressure, and of friction.
  VectorXd Torque(const RobotState& state, const VectorXd& acceleration, robot::Foot stance) const {
    const robot::RobotData data = robot::Evaluate(model_, state);
    const VectorXd force = data.mass_matrix * acceleration + data.bias + data.gravity;
    const auto& jacobian = data.foot_jacobian[stance];
    robot::Vector6d wrench =
        jacobian.leftCols<6>().transpose().partialPivLu().solve(force.head<6>());
    // What the sole cannot give turns the body.
    const robot::FootModel& foot = model_.feet()[stance];
    const double roll = (0.5 * foot.width - limits_.sole_margin) * std::abs(wrench[2]);
    const double pitch = (0.5 * foot.length - limits_.sole_margin) * std::abs(wrench[2]);
    wrench[3] = std::clamp(wrench[3], -roll, roll);
    wrench[4] = std::clamp(wrench[4], -pitch, pitch);
    VectorXd torque = force.tail(model_.num_joints()) -
                      jacobian.rightCols(model_.num_joints()).transpose() * wrench;
    for (int j = 0; j < model_.num_joints(); ++j) {
      const robot::MotorModel& motor = model_.motors()[static_cast<size_t>(j)];
      const double velocity = state.joint_velocity[j];
      torque[j] += motor.viscous_friction * velocity;
      if (std::abs(velocity) > motor.stribeck_velocity) {
        torque[j] += std::copysign(motor.coulomb_friction, velocity);
      }
    }
    return torque;
  }

  /// s between samples.
  double interval() const { return single() / kSamples; }

 private:
  const robot::RobotModel& model_;
  double height_;
  stepping::RecoverySpec spec_;
  stepping::StepLimits limits_;
  VectorXd nominal_;
};

VectorXd Velocity(const RobotState& state) {
  VectorXd velocity(6 + state.joint_velocity.size());
  velocity << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
  return velocity;
}

}  // namespace

std::optional<StepLoads> LoadsOfAStep(const robot::RobotModel& model, const RobotState& stance,
                                      const VectorXd& standing) {
  const Step step(model, stance);  // refuses what the run would
  const VectorXd none = VectorXd::Zero(model.num_joints());
  StepLoads loads{standing, none, none};
  VectorXd square = none;  // mean over the time on one foot, of both feet's steps
  for (const robot::Foot foot : robot::kFeet) {
    const auto states = step.States(foot);
    if (!states) return {};
    // The ends are left out: a difference to one side alone is known there, half a sample off.
    for (size_t i = 1; i + 1 < states->size(); ++i) {
      const RobotState& state = (*states)[i];
      const VectorXd acceleration =
          (Velocity((*states)[i + 1]) - Velocity((*states)[i - 1])) / (2 * step.interval());
      const VectorXd torque = step.Torque(state, acceleration, foot).cwiseAbs();
      loads.torque = loads.torque.cwiseMax(torque);
      loads.velocity = loads.velocity.cwiseMax(state.joint_velocity.cwiseAbs());
      square += torque.cwiseAbs2() / (2.0 * static_cast<double>(states->size() - 2));
    }
  }
  const double single = step.single(), both = step.both();
  loads.rms = ((single * square + both * standing.cwiseAbs2()) / (single + both)).cwiseSqrt();
  return loads;
}

}  // namespace poise
