// Steps that the capture point leads: when, which foot, where, and how the COM is led meanwhile.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/footwork.h"
#include "components/step_planner/stepping/step_choice.h"
#include "components/step_planner/stepping/stride_correction.h"

namespace poise::stepping {

/// Numbers that a robot or a scenario sets, in m, s, N.
struct RecoverySpec {
  LandingSpec landing;
  /// m·s²: the inertia with which the body turns, soles and COM at rest, over the robot's weight.
  double turn_share = 0;
  /// m inside the soles: a capture point that is nearer to their edge for a while and comes out
  /// needs a step; 0: no such rule.
  double margin_to_sole_edge = 0;
  /// m inside the soles, within which is known whether a step helps; < 0: nowhere.
  double watched_margin = -1;
  /// m by which the COM can be lower than it stands, on one leg for as long as one likes. A walk
  /// keeps it that low.
  double holding_lowering = 0;
};

/// The steps that catch a push, those of a dynamic walk, and the one that puts the feet side by
/// side: StepReason says which. Pure function of its calls; never allocates.
class Recovery {
 public:
  /// s of the ramp (61) that loads a landed foot, and leads the centre of pressure onto it. A push
  /// leaves no time: G1 with 12 joints stands 39 of 60 with 0.02, and 32 with 0.06. A walk with
  /// 0.02 stands fewer pushes than with 0.06 (docs/lab/steps).
  static constexpr double kLoadTime = 0.02, kWalkLoadTime = 0.06;
  /// ωT of a walk's step. Fitted: of 64 runs 56, 57 and 60 stand with 1.1, 1.3 and 1.5; G1 stands
  /// 136 of 192 pushes in a walk with 1.3, 127 with 1.1 and 112 with 1.5.
  static constexpr double kOmegaStepTime = 1.3;
  /// The sole rises by 3 cm. It meets the ground with 0.25 m/s: sooner down is a larger push,
  /// harder a bounce. The foothold stays for the last 0.05 s: a move within less would jerk the
  /// leg.
  static constexpr SwingSpec kSwing{.clearance = 0.03, .touch_speed = 0.25, .freeze = 0.05};

  Recovery() = default;
  Recovery(const StepChoice& choice, const RecoverySpec& spec)
      : choice_(choice), spec_(spec), foot_(spec.landing) {}

  /// Once a tick. False: idle, `output` is not to be used.
  bool Update(const StepInput& input);
  /// The feet side by side, once the robot rests on both; no effect where they are.
  void BringTogether() { together_asked_ = true; }
  const StepOutput& output() const { return output_; }
  bool active() const { return stage_ != Stage::kStanding; }
  /// A step is under way, or one would help: false only within `watched_margin` of the soles' edge,
  /// or beyond it, where none does and another strategy may have the centre of pressure.
  bool would_step() const { return active() || step_helps_; }
  Stage stage() const { return stage_; }
  StepReason reason() const { return reason_; }
  int num_begun() const { return num_begun_; }  ///< since the start
  StepStatus status() const;
  const ContactPlan& steps() const { return steps_; }
  const StepChoice& choice() const { return choice_; }
  /// What is walked now: the command, approached without haste.
  const WalkCommand& command() const { return command_; }
  /// The body heads where the feet do: it has walked since it last stood.
  bool turns() const { return turns_; }
  /// rad, rad/s, rad/s² about the vertical, of the body since it stood.
  const Quintic::Point& body_yaw() const { return heading_.turned(); }
  void Archive(StateArchive* archive);

 private:
  /// m that the capture point is beyond the soles in contact; negative inside.
  double Excess(const StepState& state) const;
  /// Keeps the times of what has to last. `excess`: m.
  void Watch(double time, double excess);
  /// The tick of a robot that stands: whether a step, a walk or feet side by side begin.
  void Stand(const StepInput& input, const StepState& state, double excess);
  /// The tick on both feet after a step: whether another one begins, or the COM rests.
  void Catch(const StepInput& input, const StepState& state);
  StepReason NeedOfFirstStep(const StepInput& input, const StepState& state, double excess);
  /// False, and no effect: no foot can make this step.
  bool BeginStep(const StepInput& input, const StepPlan& plan, StepReason reason);
  /// The plan's foot leaves: from the motion `from` and turned by `rotation`, or from where its
  /// sole stands.
  void LiftOff(const StepInput& input, const PointMotion& from, const Eigen::Matrix3d& rotation);
  void LiftOff(const StepInput& input);
  /// Until its foot leaves the ground a step that catches a push is chosen anew, place and time.
  /// Then, as a walk's, its foothold is where the capture point now says. A walk's step in the air
  /// that misses its place becomes one that catches a push, in the time that this takes.
  void Replan(const StepInput& input, const StepState& state);
  void Land(const StepInput& input);
  /// While the landed foot is loaded. True: the other foot leaves, since the landed one carries
  /// more and a walk goes on, or the capture point is not well inside the soles.
  bool StepAtLanding(const StepInput& input, const StepState& state);
  bool AtRest(const StepInput& input, const StepState& state);
  /// What the body's return to upright takes of the centre of pressure, m, at most `budget`.
  Eigen::Vector2d ForBody(const StepInput& input, double budget) const;
  /// The centre of pressure wanted on the stance sole while a foot is unloaded or swings, and on
  /// both soles else.
  Eigen::Vector2d BrakingCop(const StepInput& input, const StepState& state) const;
  Eigen::Vector2d CatchingCop(const StepInput& input, const StepState& state) const;
  /// m, world: where the capture point comes to rest.
  Eigen::Vector2d MiddleOfSoles(const StepState& state) const;
  /// The gait of the command, which is corrected by what the last strides came to.
  Gait gait(const StepState& state) const;
  /// The step of a walk, or of a recovery where the walk's misses its place.
  StepPlan WalkOn(const StepState& state, Foot foot, double unload, StepReason* reason) const;
  /// `stride`, or a recovery's step of its foot where that misses its place.
  StepPlan OrCaught(const StepState& state, const StepPlan& stride, double unload,
                    StepReason* reason) const;
  /// From rest on both feet the capture point leaves for another place.
  void BeginShift(const StepInput& input, const StepState& state);
  /// From rest: the capture point goes to where the first step begins.
  void SetOff(const StepInput& input, const StepState& state);
  /// From rest: the capture point on its way there; then the first step, or one that a push asks
  /// for.
  void ShiftToStride(const StepInput& input, const StepState& state, double excess);
  /// Tells the correction of a foot that has landed; a step that a push has moved tells nothing.
  void CountStride(const StepInput& input);
  /// The body's heading follows the feet's from now on.
  void BeginTurning(const StepState& state);
  void TurnBody(const StepState& state, double period);
  /// It is time for the feet to be put side by side, and `plan` does it.
  bool TogetherNow(const StepInput& input, const StepState& state, StepPlan* plan);
  /// The COM on its way above the foot that stays; then the other one leaves the ground.
  void Shift(const StepInput& input, const StepState& state, double excess);
  /// The centre of pressure on `support` that leads the capture point along `reference`, with the
  /// return of the body to upright, which takes `budget`, m, of it at most.
  Eigen::Vector2d CopFor(const StepInput& input, const StepState& state,
                         const balance::ConvexPolygon& support, const CaptureReference& reference,
                         double budget) const;
  double UnloadTime() const;
  double LoadTime() const;
  /// Share of the ramp under way, unloading or loading, that has passed at `time`, s.
  double Ramp(double time) const;
  void SetPlan(const StepPlan& plan);
  /// A push while the feet are put side by side: the step catches it from now on. A foot that is
  /// being unloaded goes on from the load that it has, faster.
  void Hurry(double time);
  void LeadCom(const StepInput& input, const StepState& state);
  double LoweringShare(const StepState& state) const;

  // Ratio: by this share of the capture point's error the centre of pressure goes beyond it, so
  // that the error decays at this times ω.
  static constexpr double kGain = 0.4;
  // 1/s with which the COM's height goes where the legs ask for it, in a step that catches a push
  // (fitted: docs/lab/steps/2026-11-29-knees-that-stay-bent.md) and else, and the body's heading
  // where the feet's is.
  static constexpr double kCatchingHeightRate = 20, kHeightRate = 8, kYawRate = 6;
  // m/s², a share of g, with which a commanded velocity is approached, and rad/s², a turn rate:
  // some steps to full speed, each within reach.
  static constexpr double kAcceleration = 0.05 * robot::kGravity, kTurnAcceleration = 1;
  // s in which a walk that begins brings the capture point to where its first step starts.
  static constexpr double kSetOffTime = 0.5;
  // m of the capture point outside the soles that turns a walk's first shift, or the step that puts
  // the feet side by side, into a recovery's step.
  static constexpr double kLeastExcess = 0.02;
  // m of centre of pressure, at most, for the return of the body to upright while a foot swings.
  static constexpr double kSwingBudget = 0.02;

  StepChoice choice_;
  RecoverySpec spec_;
  Stage stage_ = Stage::kStanding;
  StepReason reason_ = StepReason::kNone;
  int num_begun_ = 0, steps_now_ = 0;
  FootArray<bool> in_contact_{true, true};
  StepPlan plan_;  // of the first step, or of the last one that has landed
  ContactPlan steps_;
  FootMotion foot_;
  double time_ = 0, since_ = 0;  // s, last tick; when the stage began
  double ramp_from_ = 0;         // share of the unloading ramp where `cop_from_` was asked for
  // The capture point is beyond the soles, and near their edge or beyond.
  LastingCondition outside_, near_edge_;
  bool stays_outside_ = false, stays_near_edge_ = false;  // for as long as a step asks for
  double excess_at_edge_ = 0;                             // m, when it came near the edge
  double moving_since_ = 0;                               // s, last time not at rest
  Eigen::Vector2d cop_from_ = Eigen::Vector2d::Zero();    // m, when the stage began
  bool step_helps_ = true;                                // of the last idle tick
  bool together_asked_ = false;
  CaptureMove shift_;               // of the capture point from rest
  double standing_height_ = 0;      // m, above the soles, before the first step
  DampedLead height_{kHeightRate};  // m, world, of the COM's reference
  WalkCommand command_;
  StrideCorrection stride_;
  double transfer_ = 0.5 * kWalkLoadTime;  // s from a walk's touch-down until the foot carries
  BodyHeading heading_{kYawRate};
  bool turns_ = false;
  StepOutput output_;
};

}  // namespace poise::stepping
