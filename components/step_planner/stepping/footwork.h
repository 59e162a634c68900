// What every planner of steps does in a tick: sees the robot as a pendulum on its soles and leads
// the COM by a centre of pressure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/framework/state_archive.h"
#include "components/framework/tick_time.h"
#include "components/messages/motion.h"
#include "components/messages/quintic.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/stepping/contact_plan.h"
#include "components/step_planner/stepping/foot_motion.h"
#include "components/step_planner/stepping/step_choice.h"
#include "poise/planner_status_t.hpp"

namespace poise::stepping {

/// The robot in one tick; world axes, feet right first.
struct StepInput {
  double time = 0;  ///< s, not decreasing
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Eigen::Vector3d com_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero();  ///< about the COM per mass, m²/s
  /// The body is turned by `lean` (rad) from where it is to be, and turns with `turning` (rad/s).
  Eigen::Vector3d lean = Eigen::Vector3d::Zero(), turning = Eigen::Vector3d::Zero();
  FootArray<Eigen::Isometry3d> sole{Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
  FootArray<double> load{0, 0};            ///< N
  FootArray<double> load_deviation{0, 0};  ///< N, standard deviation of an observed load; else 0
  FootArray<bool> in_contact{true, true};  ///< of the plan; while no step is under way
  PointMotion free_foot;                   ///< reference of a foot in the air; likewise
  Eigen::Matrix3d free_rotation = Eigen::Matrix3d::Identity();
  double com_height = 0;     ///< m, world, of the COM's reference; likewise
  bool step_needed = false;  ///< PLANNER_STATUS.step_needed of the tick before
  bool allowed = true;       ///< a first step may begin
  WalkCommand command;       ///< of a planner that is told to walk
};

/// Why a step was made.
enum class StepReason : int8_t {
  kNone = planner_status_t::REASON_NONE,
  kPersistent = planner_status_t::REASON_PERSISTENT,  ///< the capture point stayed beyond the soles
  kOutside = planner_status_t::REASON_OUTSIDE,      ///< so far that nothing else can bring it back
  kLingering = planner_status_t::REASON_LINGERING,  ///< at the edge for long, and coming out
  kAgain = planner_status_t::REASON_AGAIN,          ///< the step before did not catch it
  kWalk = planner_status_t::REASON_WALK,            ///< the robot walks
  kTogether = planner_status_t::REASON_TOGETHER,    ///< the feet are put side by side
};

/// What a planner of steps says of itself.
struct StepStatus {
  Stage stage = Stage::kStanding;
  StepReason reason = StepReason::kNone;  ///< of the step under way, or the last
  bool under_way = false;                 ///< `step` is planned or under way; else it has landed
  Footstep step;
  double margin = 0;  ///< StepPlan::margin of that step
};

/// What the plan takes over while steps are made.
struct StepOutput {
  FootArray<bool> in_contact{true, true};
  TransitionKind transition = TransitionKind::kNone;  ///< of `foot`
  double progress = 0;
  Foot foot = Foot::kRight;  ///< that steps, or last did
  PointMotion com;
  PointMotion swing;
  RotationMotion swing_rotation;
  Landing::State foot_state = Landing::State::kSwing;  ///< of the foot in the air
  Eigen::Vector2d cop = Eigen::Vector2d::Zero();       ///< m, world, that is wanted
  /// m, world, on the ground: the centre of pressure that `com` follows, `cop` less the observed
  /// offset of the pendulum.
  Eigen::Vector3d cop_reference = Eigen::Vector3d::Zero();

  /// The foot's motion in this tick.
  void Follow(const FootMotion& motion) {
    swing = motion.reference();
    swing_rotation = motion.rotation();
    foot_state = motion.state();
  }
  void Archive(StateArchive* archive);
};

/// rad, of a frame's x axis about the vertical.
double Yaw(const Eigen::Isometry3d& pose);

/// The pendulum above the soles in contact. `momentum`: share of the angular momentum that counts
/// as the COM's own. All of it: what leg and body give each other and the COM changes nothing,
/// since the momentum about the centre of pressure is gravity's alone.
StepState Observe(const StepInput& input, const FootArray<bool>& in_contact, double momentum = 0);

/// A number led to a wanted one, critically damped; at most with 0.25 g in its own unit, so that
/// soles stay loaded below a COM whose height is led.
class DampedLead {
 public:
  /// `rate`, 1/s: critically damped, two such poles.
  explicit DampedLead(double rate = 1) : rate_(rate) {}
  void Begin(double height) { point_ = {height, 0, 0}; }
  void set_rate(double rate) { rate_ = rate; }  ///< 1/s, from now on
  void Follow(double wanted, double period);
  const Quintic::Point& point() const { return point_; }
  void Archive(StateArchive* archive) { archive->Show(point_); }

 private:
  double rate_;
  Quintic::Point point_;
};

/// The body's heading, led without haste to the middle of the soles' headings.
class BodyHeading {
 public:
  /// `rate`, 1/s: DampedLead's.
  explicit BodyHeading(double rate = 1) : turned_(rate) {}
  /// The robot stands and heads along `yaw`, rad.
  void Begin(double yaw) {
    start_ = yaw;
    turned_.Begin(0);
  }
  /// Once a tick of `period` s; rad, of the stance sole and of the other one, or of where that will
  /// stand.
  void Follow(double stance, double other, double period);
  /// rad, rad/s, rad/s² about the vertical, since it stood.
  const Quintic::Point& turned() const { return turned_.point(); }
  void Archive(StateArchive* archive) { archive->Show(start_, turned_); }

 private:
  double start_ = 0;  // rad
  DampedLead turned_;
};

/// Leads the COM by the centre of pressure `cop`, m, world, on the ground: in x and y it has the
/// pendulum's acceleration (g + z̈)/(z − ground) (c − p), and neither position nor velocity to
/// follow: they are the COM's own; in z it follows `height`.
PointMotion LeadByCop(const StepInput& input, const Quintic::Point& height,
                      const Eigen::Vector3d& cop);

}  // namespace poise::stepping
