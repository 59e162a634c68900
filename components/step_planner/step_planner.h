// The step planner: phases, references and capture point, the order and the report of a tick.
#pragma once

#include <memory>
#include <optional>

#include "components/balance/capture_point.h"
#include "components/balance/whole_body.h"
#include "components/framework/component_type.h"
#include "components/framework/operator_acts.h"
#include "components/framework/tick_time.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/contact/contact_loss.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/footstep_report.h"
#include "components/step_planner/hip_strategy.h"
#include "components/step_planner/phase_schedule.h"
#include "components/step_planner/reference_generator.h"
#include "components/step_planner/stance_follower.h"
#include "components/step_planner/stepping/recovery.h"
#include "components/step_planner/walk_config.h"
#include "poise/planner_status_t.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "steps/message_traits.hpp"

namespace poise {

/// Who moves the feet in a tick. stepping::Recovery makes the steps of a dynamic walk, too, and
/// puts the feet side by side: their owner is kRecovery. kWalk is the quasi-static walk alone.
///
/// | from           | to       | when |
/// |----------------|----------|------|
/// | phases, stance | recovery | a push needs a step, a dynamic walk or feet side by side are asked
/// for | | phases, stance | walk     | a quasi-static walk is commanded, and both feet are contacts
/// | | walk           | recovery | on one foot the capture point has left the stance sole | |
/// recovery       | walk     | it has ended, and a quasi-static walk is commanded | | recovery,
/// walk | phases   | it has ended on the feet that the phase stands on | | recovery, walk | stance
/// | it has ended on both feet, where the phase stands on one |
enum class FeetOwner : int8_t {
  kPhases = planner_status_t::OWNER_PHASES,
  kRecovery = planner_status_t::OWNER_RECOVERY,
  kWalk = planner_status_t::OWNER_WALK,
  kStance = planner_status_t::OWNER_STANCE
};

/// ROBOT_STATE -> SUPPORT_PLAN, PLANNER_STATUS, and FOOTSTEPS where it makes steps. When a state is
/// invalid plan and report of the last good tick are sent again, the plan with the status set.
class StepPlanner : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  /// Where the COM can be brought to rest, seen from the soles in contact.
  struct Capture {
    bool known = false;  ///< else the COM is below the soles, or a number is not finite
    Eigen::Isometry3d frame_o = Eigen::Isometry3d::Identity();
    /// It counts the COM's own momentum alone; Recovery's counts angular momentum, too.
    balance::CapturePoint pendulum;
  };

  void ConfigureLimits(const StepPlannerConfig& config);
  void TakeActs(const Tick& tick);
  /// VERDICT_* of an operator's act.
  int8_t Act(const operate::act_t& act, double time);
  /// The scenario's or the port's, until an operator has commanded another.
  stepping::WalkCommand WalkCommandAt(double time) const;
  /// Steps since the start: begun ones of a dynamic walk, landed ones of a quasi-static walk.
  int NumSteps() const { return walks_dynamically_ ? recovery_.num_begun() : walk_.num_landed(); }
  /// STATUS_* of the plan.
  int8_t Plan(double time);
  ScheduleInput Observe(double time, const robot::FootArray<double>& load);
  /// N, standard deviation of an observed load; 0 of a measured one.
  double LoadDeviation(robot::Foot foot) const;
  /// Runs the tick of recovery and walk, and settles who owns the feet.
  void ChooseOwner(double time, const robot::FootArray<double>& load);
  void HandOver(FeetOwner to, double time);
  stepping::StepInput MakeStepInput(double time, const robot::FootArray<double>& load);
  /// What leads COM and feet in place of the schedule; null: nothing does.
  const stepping::StepOutput* Steps() const;
  /// References from where `steps` have left the robot.
  void EndSteps(const stepping::StepOutput& steps, double time);
  /// Another planner than the phases owns the feet: the schedule is held, which is no waiting.
  bool Held() const { return owner_ != FeetOwner::kPhases; }
  /// The body's heading follows the feet.
  void TurnBody(const Quintic::Point& yaw);
  /// Contacts, references and landings of a phase's first tick.
  void BeginPhase(double time);
  Capture ComputeCapture() const;
  /// Moves the COM's reference with soles that have gone elsewhere.
  void FollowSoles(double time);
  /// The plan's references where the free foot follows them, else its landing's.
  void UpdateReferences(double time, const Capture& capture);
  /// Turns the body's reference by the hip strategy's tilt.
  void TiltBody(double time, const Capture& capture);
  /// A joint of a stance leg that would come too near to its limit before it could be braked.
  bool NearJointLimit() const;
  EstimatedPose Estimate() const;
  balance::ContactGeometry Geometry() const;
  /// Hull of the soles in contact; `sole`: in their own frames.
  balance::ConvexPolygon Soles(const Eigen::Isometry3d& frame_o,
                               const robot::FootArray<balance::ConvexPolygon>& sole) const;
  /// By foot: it alone can carry the robot, as the capture point, where the COM can be brought to
  /// rest, lies inside its reduced sole. At rest that is the COM's projection, and the CoP.
  robot::FootArray<bool> CanCarryAlone() const;
  /// Fills the tick's messages, but for the plan's status.
  void Report(double time, const Capture& capture);

  Input<robot_state_t> robot_state_;
  ActInput operator_;
  Input<::steps::stride_t> stride_;  // where stride_port_ is
  Output<support_plan_t> support_plan_;
  Output<planner_status_t> planner_status_;
  Output<::steps::footsteps_t> footsteps_;  // where it makes steps

  std::shared_ptr<const robot::RobotModel> model_;
  std::shared_ptr<balance::WholeBody> whole_body_;
  std::optional<PhaseSchedule> schedule_;
  ReferenceGenerator generator_;
  StanceFollower stance_follower_{0};
  HipStrategy hip_strategy_;
  bool tilts_ = false;  // hip_strategy.enabled
  robot::FootArray<Landing> landing_{Landing(LandingSpec())};
  robot::FootArray<ContactLoss> contact_loss_{ContactLoss(0)};
  HeldCondition step_needed_;
  bool has_recovery_ = false;  // recovery_ is there
  stepping::Recovery recovery_;
  bool walks_quasi_static_ = false;  // by walk_
  bool walks_dynamically_ = false;   // by recovery_
  bool stride_port_ = false;
  stepping::WalkCommand planned_;  // of the port's last message
  stepping::QuasiStaticWalk walk_;
  WalkCommands walk_commands_;
  FootstepReport footstep_report_;
  /// What an operator has told the robot to walk.
  struct OperatorWalk {
    bool given = false, stepping = false;
    bool one_step = false;  // of each foot
    int32_t steps_before = 0;
    double velocity[3] = {0, 0, 0};  // m/s ahead, m/s to the left, rad/s
  } operator_walk_;
  FeetOwner owner_ = FeetOwner::kPhases;
  // A foot that a phase put down may stand on ground that gives way: its sole is not followed.
  bool was_free_ = false;
  References references_;
  Eigen::Matrix3d untilted_ =
      Eigen::Matrix3d::Identity();  // the body's reference less the hip strategy's tilt
  robot::RobotState state_;
  robot::FootArray<bool> in_contact_{true, true};
  bool has_tasks_ = false;  // of the phase; until BeginPhase has ended: of the one before it
  // m, sole frames: whole, less what the hip strategy starts from, and what one foot balances on.
  robot::FootArray<balance::ConvexPolygon> sole_, tilt_sole_, stance_sole_;
};

ComponentType StepPlannerType();

}  // namespace poise
