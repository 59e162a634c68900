// Walking on ground that is not known: the capture point waits above the sole that carries until
// the other foot does too.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/footsteps.h"
#include "components/step_planner/stepping/footwork.h"
#include "components/step_planner/stepping/known_ground.h"
#include "components/step_planner/stepping/sole_memory.h"
#include "components/step_planner/stepping/step_choice.h"

namespace poise::stepping {

/// Numbers that a robot or a scenario sets, in m, s, N.
struct QuasiStaticSpec {
  double start = 0;   ///< s in which the COM leaves the middle for the first stance foot
  double unload = 0;  ///< s of the ramp that unloads a foot
  double swing = 0;   ///< s
  double load = 0;    ///< s of the ramp that loads it again
  FootstepLimits step;
  double turn_acceleration = 0;  ///< rad/s², with which a turn rate is approached
  SwingSpec foot;
  LandingSpec landing;
  double most_offset = 0;                ///< m, of the pendulum's observed offset
  double com_lowering = 0;               ///< m below standing at which it walks
  double height_rate = 0, yaw_rate = 0;  ///< 1/s, with which height and heading of the body follow
  /// The robot is still: m from the soles' middle to the capture point, m/s of the COM, s of both.
  double still_distance = 0, still_speed = 0, still_time = 0;
  double lift_off_distance = 0;  ///< m from the stance sole's middle to the capture point, at most
  double most_return = 0;        ///< m, rad by which a foothold comes back to the course at most
  KnownGround ground;
  /// m by which the load of a foot may leave it sooner than the centre of pressure does: what each
  /// sole's own is off its middle then.
  double load_lead = 0;
  double weight = 1;        ///< N, of the robot
  double most_sinking = 0;  ///< m that a sole is expected to sink at most
  double most_ahead = 0;    ///< m by which the COM goes down at most before the stance sole does
  double soft = 0;          ///< m of sinking under the weight, above which ground counts as soft

  /// s from touch-down to touch-down.
  double period() const { return unload + swing + landing.settle + load; }
};

/// Where the ramp (61) has risen to `share`.
double RampStart(double share);

/// Pure function of its calls; never allocates.
class QuasiStaticWalk {
 public:
  /// Share of the weight with which a foot that has touched is pressed down, so that the sole lies
  /// down on what it has found. More than 0.4 would lift the other foot off its middle.
  static constexpr double kPressShare = 0.1;
  /// m/s that a sole sinks on average while it is loaded: the paper's robot loads as fast on 10
  /// kN/m as on hard ground.
  static constexpr double kSinkSpeed = 0.04;

  QuasiStaticWalk() = default;
  QuasiStaticWalk(const StepChoice& choice, const QuasiStaticSpec& spec);

  /// Once a tick. False: the robot stands, `output` is not to be used.
  bool Update(const StepInput& input, const WalkCommand& command);
  const StepOutput& output() const { return output_; }
  bool active() const { return stage_ != Stage::kStanding; }
  Stage stage() const { return stage_; }
  int num_landed() const { return num_landed_; }  ///< feet that have landed, since the start
  /// Steps begun since the start, the one under way too.
  int num_begun() const {
    const bool under_way = active() && stage_ != Stage::kLoading && stage_ != Stage::kCatching;
    return num_landed_ + (under_way ? 1 : 0);
  }
  Foot stepping_foot() const { return Other(stance_); }  ///< that is in the air, or the next to be
  /// On one foot, the capture point is beyond the stance sole: the walk does not bring it back.
  bool Lost(const StepInput& input) const;
  /// Another planner moves the feet in this tick.
  void Stop(double time) {
    time_ = time;
    num_landed_ = num_begun();
    lowered_ = lowered_ || active();
    stage_ = Stage::kStanding;
    steps_.Clear();
  }
  StepStatus status() const;
  /// The step under way or next, and those that follow if the command stays.
  const ContactPlan& steps() const { return steps_; }
  const StepChoice& choice() const { return choice_; }
  double period() const { return spec_.period(); }  ///< s from touch-down to touch-down
  /// What is walked now: the command, approached without haste.
  const WalkCommand& command() const { return command_; }
  /// rad, rad/s, rad/s² about the vertical, of the body since it stood.
  const Quintic::Point& body_yaw() const { return heading_.turned(); }
  /// m, world: where the capture point shall be, before its error is fed back.
  const Eigen::Vector2d& wanted() const { return wanted_.point; }
  void Archive(StateArchive* archive);

 private:
  void Enter(Stage stage, double time);
  void Start(const StepInput& input, const StepState& state, const WalkCommand& command);
  void BeginSwing(const StepInput& input);
  /// Share of the press' load on the foot that comes down, at most 1.
  double Loaded(const StepInput& input) const;
  /// m, by which the stance sole has sunk into unknown ground.
  double Sunk(const StepInput& input) const;
  /// m, world: what is told of the ground, or where the stance sole met it, from where the other
  /// sole stands.
  double GroundAt(const StepInput& input, const Foothold& foothold) const;
  /// m, world: the highest COM from which the foot reaches down to the foothold that it is told of.
  double HighestForStep(const StepInput& input, const StepState& state) const;
  /// How far the ramp that is under way has come, 0 to 1.
  double Progress(double time) const;
  /// The unloading ramp, no sooner than the centre of pressure goes over.
  void Unload(const StepState& state, double period);
  void Land(const StepInput& input, const StepState& state, const WalkCommand& command);
  bool OnOneFoot() const { return stage_ == Stage::kSwinging || stage_ == Stage::kTouching; }
  bool AtRest(const StepInput& input, const StepState& state);
  /// The steps to come: the next one is to `first`, its foot is unloaded from `unload` on, s.
  void PlanSteps(const Foothold& first, double unload);
  Foothold Next(const Foothold& stance, Foot foot) const;
  /// Next, brought back to the commanded course.
  Foothold NextOnCourse(const Foothold& stance, Foot foot) const;
  /// The foot may leave the ground.
  bool LiftsOff(const StepState& state, double time) const;
  double Transfer() const { return ramp_slowdown_ * (spec_.load + spec_.unload); }  ///< s
  /// What to ask for so that the capture point moves as of `cop`, m: what legs that swing and a
  /// body that turns add to the pendulum is observed, ξ̇ = ω (ξ − asked − offset), and taken off.
  Eigen::Vector2d WithoutOffset(const StepState& state, const Eigen::Vector2d& cop, double period);
  /// s: slower where the sole that stands has sunk, as the root of it. The leg's reaction then goes
  /// down as the centre of pressure does that the sole takes without rolling to the ankle's limit.
  double SwingTime() const;
  /// m, world: where the COM would stand above the soles that carry.
  double Height(const StepInput& input, const StepState& state);
  /// m, that the stance sole goes down yet under the whole weight, as its load so far lets expect.
  double StillSinks(const StepInput& input);
  /// Where the soles can have their common centre of pressure at the load that the ramp gives them,
  /// for a centre of pressure that is wanted at `cop`.
  balance::ConvexPolygon Carrying(const StepInput& input, const StepState& state,
                                  const Eigen::Vector2d& cop) const;
  /// From above one sole to above the other while both carry.
  CaptureReference Wanted(const StepState& state, double time) const;
  Eigen::Vector2d DesiredCop(const StepInput& input, const StepState& state);
  /// A sole has sunk. The control of a phase that stands would stir it: the walk goes on without
  /// steps.
  bool OnSoftGround() const;
  void Lead(const StepInput& input, const StepState& state);

  // m/s² with which a commanded velocity is approached: a hundredth of g, on any robot.
  static constexpr double kAcceleration = 0.1;
  // Ratio: by this share of the capture point's error the centre of pressure goes beyond it, so
  // that the error decays at this times ω.
  static constexpr double kGain = 0.5;

  StepChoice choice_;
  QuasiStaticSpec spec_;
  Stage stage_ = Stage::kStanding;
  WalkCommand command_;
  Foot stance_ = Foot::kRight;
  int num_landed_ = 0;
  FootArray<bool> in_contact_{true, true};
  ContactPlan steps_;  // empty: no step follows the one that has landed
  FootMotion foot_;
  DampedLead height_;
  BodyHeading heading_;
  DampedLead pressed_;                              // share that the press carries
  double time_ = 0, since_ = 0, moving_since_ = 0;  // s: last tick; stage; not at rest
  FootArray<SoleMemory> sole_;
  double ramp_slowdown_ = 1;    // ratio: the ramps, where the sole sinks
  double unloaded_ = 0;         // of the unloading ramp
  double ramp_start_ = 0;       // of the loading ramp: what the press carries
  double standing_height_ = 0;  // m
  bool lowered_ = false;        // stopped while it walked: it has not stood up since
  bool starting_ = false;       // no foot has left the ground yet
  Foothold course_;    // where the stance sole would stand if every step came down as commanded
  CaptureMove start_;  // of the capture point while starting
  CaptureReference wanted_;
  Eigen::Vector2d predicted_capture_point_ =
      Eigen::Vector2d::Zero();                          // m, capture point by the pendulum
  Eigen::Vector2d offset_ = Eigen::Vector2d::Zero();    // m, of the centre of pressure it obeys
  Eigen::Vector2d cop_jump_ = Eigen::Vector2d::Zero();  // m, of the last stage's at its end
  StepOutput output_;
};

}  // namespace poise::stepping
