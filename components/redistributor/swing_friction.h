// Feed-forward of the friction in the joints of a leg that swings.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "components/framework/state_archive.h"
#include "components/redistributor/redistributor.pb.h"
#include "components/robot/robot_model.h"

namespace poise {

/// N·m that a motor needs against Coulomb and viscous friction at the joint's `velocity`, rad/s,
///   τ_c tanh(q̇ / smoothing) + d q̇:
/// odd and increasing, below the robot file's friction by 0.24 τ_c at a smoothing of 0.05 rad/s and
/// less beyond it, so that the torque does not chatter at rest. Static friction's excess is left
/// out: it would make the torque steepest where the velocity's sign is least known.
double FrictionTorque(const robot::MotorModel& motor, double velocity);

/// The tasks take the joints for free of friction, so that dry friction holds an error of τ_c over
/// the joint's stiffness, and viscous friction lets the leg follow late: a foot out of contact
/// comes down tilted. One that carries little is turned with the shank by its ankle's friction,
/// until its load holds the sole. At the measured velocity a joint that sticks would get nothing:
/// the torque is that at the velocity which the tasks ask for, q̇ + lead q̈, q̈ of the model without
/// friction.
class SwingFriction {
 public:
  SwingFriction() = default;  ///< none
  /// `period`, s, of a tick. Throws ConfigError (paths inside FrictionCompensation).
  SwingFriction(const FrictionCompensation& config, const robot::RobotModel& model, double period);

  /// Once a tick, before Add: leads what each leg gets to what its foot leaves open, 1 out of
  /// contact; where a foot's load is `ramped`, less with its load; else 0. A foot that a push
  /// unloads gets nothing: friction damps it. `eta`: share of F_z that the right foot carries.
  void Ramp(const robot::FootArray<bool>& in_contact, bool ramped, double eta);
  /// Whether Add would add anything.
  bool acts() const { return swing_[robot::Foot::kRight] > 0 || swing_[robot::Foot::kLeft] > 0; }
  /// Adds to `torque` (N·m, by joint). `velocity` rad/s and `acceleration` rad/s² by joint. A joint
  /// that carries both feet gets what the more loaded one leaves.
  void Add(const Eigen::Ref<const Eigen::VectorXd>& velocity,
           const Eigen::Ref<const Eigen::VectorXd>& acceleration, std::span<double> torque) const;
  void Archive(StateArchive* archive) { archive->Show(swing_); }

 private:
  struct Joint {
    int index = -1;
    robot::FootArray<bool> carries{};
    robot::MotorModel motor;
  };

  std::vector<Joint> joints_;  // of the legs, with friction; none: not enabled
  double share_ = 0;
  double lead_ = 0;                 // s
  double rate_ = 0;                 // of the ramp, in a tick
  robot::FootArray<double> swing_;  // 0 holds the leg, 1 swings
};

}  // namespace poise
