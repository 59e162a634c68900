// Touch-down of a free foot: contact by measured load, compliance while it touches, the search for
// a surface that is not where it was expected, and the safe end when there is none.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/framework/tick_time.h"
#include "components/messages/motion.h"
#include "components/messages/quintic.h"
#include "components/messages/touch_load.h"
#include "poise/planner_status_t.hpp"

namespace poise {

/// How a foot comes down.
struct LandingSpec {
  double touch_load = 0;    ///< N on the sole that are contact
  double release_load = 0;  ///< N below which it is lost again
  double press_load = 0;    ///< N at which the search comes to a stand, and of a press
  /// N that an observed load must be above at least to be contact; a third of it in a search.
  double observed_load = 0;
  double touch_duration = kTouchTime;  ///< s that a load must last, or its loss
  /// s from the touch until the foot counts as a contact. The default is three times relax_time's:
  /// what the lowering presses with is given back first, so that the model's change makes no step
  /// of the torque.
  double settle = 0.3;
  double search_depth = 0;  ///< m that it goes on downward at most
  /// m/s, with which it does: slow enough that the load stops it before it tips the robot.
  double search_speed = 0.03;
  /// s, time constant with which a touching foot's reference comes to where the sole stands.
  double relax_time = 0.1;
  /// A touching foot is pressed down with press_load, and settles while it is; else it is let go.
  bool presses = false;
  /// A foot that finds no ground rises again; else it waits at search_depth for a load.
  bool retracts = true;
};

/// N: the loads of a landing, raised where the load is not known so well.
struct LoadLevels {
  double touch = 0;    ///< contact is made above it
  double release = 0;  ///< and lost below it
  double press = 0;    ///< at which a search comes to a stand

  /// `deviation`: N, of an observed load; 0 of a measured one, whose noise the loads allow for.
  /// `searches`: the foot goes on downward past where the ground was expected.
  LoadLevels(const LandingSpec& spec, double deviation, bool searches = false);
};

/// Contact from a measured load, with hysteresis: it is made when the load has stayed above
/// `touch` for a duration, and lost when it has stayed below `release` as long.
class TouchDetector {
 public:
  /// `duration`: s that either must last.
  explicit TouchDetector(double duration) : duration_(duration) {}

  /// `touching`: what holds until the load says otherwise.
  void Reset(bool touching) { touching_.Reset(touching); }
  /// `time` in s, not decreasing; `load` in N, positive when the sole is pressed.
  bool Update(double time, double load, const LoadLevels& levels);
  bool touching() const { return touching_.holds(); }
  void Archive(StateArchive* archive) { archive->Show(touching_); }

 private:
  double duration_;  // s
  HeldCondition touching_;
};

/// One foot from lift-off to double support. Pure function of its calls.
///
/// Searching: the reference goes on downward at search_speed · (1 − load / press_load), which
/// presses until contact counts in spite of joint friction, and never much harder.
/// Touching: the foot is let go, or pressed in z. Its reference comes to where the sole stands, so
/// that the task asks for no acceleration and is a damper only: the sole settles flat, yields to a
/// surface that rises, and the change of the model's contact makes no step of the torque. In z this
/// is mixed with the search, by the load from `touch` (let go) down to `release` (search), so that
/// contact stays measured when no joint friction holds the foot down.
/// A foot that is pressed goes down in z at search_speed · (1 − load / press_load) instead, and up
/// where that is negative, no deeper than a search.
class Landing {
 public:
  enum class State : int8_t {
    kSwing = planner_status_t::FOOT_SWING,
    kSearching = planner_status_t::FOOT_SEARCHING,
    kTouching = planner_status_t::FOOT_TOUCHING,
    kRetracted = planner_status_t::FOOT_RETRACTED
  };

  explicit Landing(const LandingSpec& spec)
      : spec_(spec), touch_(spec.touch_duration), levels_(spec, 0) {}

  /// The foot is free from here on, its reference at rest at height `z`, m. It counts as touching
  /// the ground that it leaves until its load says that it has left.
  void LiftOff(double z);
  /// The foot swings to ground at height `z`, m; what it meets before `rises_until`, s, is left
  /// behind.
  void BeginSwing(double z, double rises_until);
  /// Its reference is to move from height `from` to `to`, m, until `end`, s. A foot that touches is
  /// not lowered any further, and a retracted one stays: false, the move is not to be made.
  bool BeginMove(double from, double to, double end);
  /// The foot follows the references again, from where it stands, though it searched or found no
  /// surface: the plan goes on otherwise.
  void Release();
  /// Once a tick, before the schedule: `load` in N along the sole's normal, and what it is known to
  /// (see LoadLevels).
  void Measure(double time, double load, double deviation = 0);
  /// Double support may begin: the foot has touched and its load has lasted for `settle`, or it has
  /// never left the ground.
  bool confirmed() const;
  /// No surface was found, and the foot is up again.
  bool found_none() const { return state_ == State::kRetracted && retreat_.Ended(time_); }

  /// Once a tick, after the schedule. `before_touch_down`: the next phase is double support; `due`:
  /// it should have begun. `reference`, `rotation`: of the scenario; replaced where the foot does
  /// not follow it, which is told by true.
  bool Update(bool before_touch_down, bool due, const Eigen::Isometry3d& sole,
              PointMotion* reference, Eigen::Matrix3d* rotation);
  State state() const { return state_; }
  const LandingSpec& spec() const { return spec_; }
  void Archive(StateArchive* archive);

 private:
  void Enter(State state, const PointMotion& reference, const Eigen::Matrix3d& rotation);
  void AdvanceState(bool before_touch_down, bool due, const Eigen::Isometry3d& sole,
                    const PointMotion& reference, const Eigen::Matrix3d& rotation);
  bool Rises() const { return !moves_down_ && time_ < move_end_; }
  bool SearchBegins(bool before_touch_down, bool due) const;
  /// Share of a first-order approach with `time_constant`, s, in this tick.
  double Share(double time_constant) const { return period_ / (time_constant + period_); }
  /// m, of the reference of a foot that does not retract.
  double Lowest() const { return end_height_ - spec_.search_depth; }
  void Search();
  void Touch(const Eigen::Isometry3d& sole);

  LandingSpec spec_;
  TouchDetector touch_;
  State state_ = State::kSwing;
  double time_ = 0, period_ = 0;  // s, of this tick, since the last
  double load_ = 0;               // N
  LoadLevels levels_;
  double touched_ = 0;            // s, when the touch, or the press' load, began
  bool has_left_ground_ = false;  // the ground or surface from which the last move started
  bool moves_down_ = false;       // the last move went down
  double move_end_ = 0;           // s
  double end_height_ = 0;         // m, where the scenario's reference ends
  PointMotion reference_;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();
  QuinticMove retreat_;
};

}  // namespace poise
