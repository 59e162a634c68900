// What becomes of a leg's torque where the ground does not bear its foot.
#pragma once

#include <vector>

#include "components/framework/state_archive.h"
#include "components/robot/robot_model.h"
#include "poise/joint_command_t.hpp"
#include "poise/robot_state_t.hpp"

namespace poise {

/// (53) takes each foot in contact for fixed to the ground. One that a push lifts, kicks away or
/// leaves without load has nothing to press against, and its torque throws the leg instead. So it
/// is given in proportion to the most that the foot may bear,
///   τ = s τ_(53) − (1 − s) d q̇,  s = (F + 2 σ) / (0.6 (|F_c| − m g / 10)), 0 ≤ s ≤ 1,
/// with F and F_c, N, the measured force on the sole, low-passed over 10 ms, and the commanded one,
/// σ a reading's standard deviation, and d, N·m·s/rad, the inertia of the joint's rotor over 5 ms.
/// Stiffness and damping that a drive closes get the share s, too. A leg in the air and the joints
/// of the upper body have the ground's reaction through the standing legs alone: they get 4 s, at
/// most 1, of the leg that bears more. Else legs thrown in flight turn the body.
/// A foot that bears more than 0.6 of its load, or is to bear next to none, changes nothing. Nor
/// does one that has not borne so much since it landed, when asked for 0.3 of the weight or more:
/// it may be a millimetre above the ground, which its torque has to find. A leg that yields still
/// loads its foot: it gets more of its torque than the foot bears of its load.
class YieldingLegs {
 public:
  YieldingLegs() = default;  ///< none
  /// `period`, s, of a tick.
  YieldingLegs(const robot::RobotModel& model, double period);

  /// Once a tick. Changes `command`'s torque, stiffness and damping; its foot_wrench is what is
  /// commanded. A joint that carries both feet yields with the one that bears more of its load.
  void Yield(const robot::FootArray<bool>& in_contact, const robot_state_t& measured,
             joint_command_t* command);
  /// Whether a leg yielded in the last tick.
  bool any() const { return any_; }
  void Archive(StateArchive* archive) { archive->Show(load_, has_borne_, any_); }

 private:
  struct Joint {
    size_t index = 0;
    robot::FootArray<bool> carries{};
    double damping = 0;  // N·m·s/rad
  };
  /// s of a foot in contact.
  double BorneShare(robot::Foot foot, const robot_state_t& measured,
                    const joint_command_t& command);

  std::vector<Joint> joints_;
  double load_gain_ = 0;                   // of load_, per tick
  double light_load_ = 0, full_load_ = 0;  // N
  robot::FootArray<double> load_;          // N, measured, low-passed
  bool any_ = false;
  robot::FootArray<bool> has_borne_;  // enough of its load, since it is in contact
};

}  // namespace poise
