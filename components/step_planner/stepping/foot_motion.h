// One foot from lift-off to contact.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/messages/motion.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/legs/swing.h"
#include "components/step_planner/stepping/contact_plan.h"

namespace poise::stepping {

struct StepInput;

/// A swing to a foothold, which a landing ends. Pure function of its calls; never allocates.
class FootMotion {
 public:
  FootMotion() = default;
  explicit FootMotion(const LandingSpec& landing) : landing_(landing) {}

  /// The foot leaves at `time`, s, from the motion `from` and turned by `rotation`, for `step`, on
  /// ground at the height `ground`, m. It is searched for down from `expected`, m.
  void LiftOff(const PointMotion& from, const Eigen::Matrix3d& rotation, const Footstep& step,
               double ground, double expected, const SwingSpec& way, double time);
  /// Another foothold, and time; see Swing::Move.
  void Move(const Footstep& step, double time);
  /// Once a tick. True: `foot`, whose sole is `model`'s, is a contact from now on. With an
  /// observed_load (LandingSpec) an observed load counts before the swing's end only where the sole
  /// is near the ground: a leg that brakes its swing is observed as a load.
  bool Update(const StepInput& input, Foot foot, const robot::FootModel& model);
  Landing::State state() const { return landing_.state(); }
  const Swing& swing() const { return swing_; }
  const PointMotion& reference() const { return reference_; }  ///< of the sole's centre
  const RotationMotion& rotation() const { return rotation_; }
  void Archive(StateArchive* archive) { archive->Show(swing_, landing_, reference_, rotation_); }

 private:
  Swing swing_;
  Landing landing_{LandingSpec()};
  PointMotion reference_;
  RotationMotion rotation_;
};

}  // namespace poise::stepping
