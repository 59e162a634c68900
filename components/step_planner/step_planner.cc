#include "components/step_planner/step_planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "components/balance/support_polygon.h"
#include "components/framework/optional_ports.h"
#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "components/messages/robot_resource.h"
#include "components/robot/sole.h"
#include "components/step_planner/planner_config.h"
#include "components/step_planner/recovery_config.h"
#include "components/step_planner/status_report.h"
#include "components/step_planner/support_plan_message.h"

namespace poise {

std::string_view step_planner_proto_schema();  // generated
namespace {

using robot::Foot;
using robot::kFeet;

// m/s and rad/s that an operator may ask for at most; a step's length limits what is walked.
constexpr double kFastestWalk = 1;
// m/s to the left: far below what moves a foothold by a rounding that anyone could measure.
constexpr double kLeftFirst = 1e-9;

// m that soles must have gone until the COM's reference goes along. Of standing soles the estimate
// wanders by 2e-5 m/√s, 1.2 mm in an hour; a push that lifts a foot moves it by centimetres.
constexpr double kFollowFrom = 0.005;
// s in which the COM's reference comes to rest between the feet after a recovery, or goes along
// with them.
constexpr double kSettleTime = 0.5;

// rad, nearer than which no stance leg's joint may come to its limit while the body turns.
constexpr double kLeastJointMargin = 0.02;

stepping::WalkCommand CommandOf(const ::steps::stride_t& stride) {
  stepping::WalkCommand command;
  command.stepping = stride.walks != 0 && stride.period > 0;
  if (!command.stepping) return command;
  command.period = stride.period;
  for (const Foot f : kFeet) {
    const size_t i = Index(f);
    command.stride[f] = {{stride.ahead[i], stride.left[i]}, stride.turn[i]};
    command.velocity += command.stride[f].position / (2 * stride.period);
    command.turn_rate += stride.turn[i] / (2 * stride.period);
  }
  return command;
}

}  // namespace

void StepPlanner::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<StepPlannerConfig>();
  CheckStepPlannerConfig(config);
  model_ = LoadRobot(context);
  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  schedule_.emplace(config);
  stance_follower_ = StanceFollower(kFollowFrom);
  ConfigureLimits(config);
  const LandingSpec landing = MakeLandingSpec(config.contact());
  landing_ = robot::FootArray<Landing>(Landing(landing));
  contact_loss_ = robot::FootArray<ContactLoss>(ContactLoss(landing.release_load));
  walks_dynamically_ = config.walk().enabled() && !config.walk().quasi_static();
  has_recovery_ = config.recovery().enabled() || walks_dynamically_;
  if (has_recovery_) {
    recovery_ = MakeRecovery(config.recovery(), config.contact(), *model_,
                             tilts_ ? HipStrategy::kStart : -1);
  }
  walks_quasi_static_ = config.walk().enabled() && !walks_dynamically_;
  stride_port_ = walks_dynamically_ && config.walk().stride_port();
  if (walks_quasi_static_) walk_ = MakeQuasiStaticWalk(config.walk(), config.contact(), *model_);
  footstep_report_ =
      FootstepReport(has_recovery_ ? &recovery_ : nullptr, walks_quasi_static_ ? &walk_ : nullptr);
  walk_commands_ = WalkCommands(config.walk());
  const stepping::StepChoice& choice = walks_quasi_static_ ? walk_.choice() : recovery_.choice();
  for (const std::string& text : WalkWarnings(config.walk(), *model_, choice)) {
    wiring->AddWarning(text);
  }
  state_ = robot::RobotState(model_->num_joints());
  in_contact_ = ContactsOf(config.phase(0).support());

  wiring->AddInput(&robot_state_, "robot_state", JointAndFootCounts(*model_));
  wiring->AddInput(&operator_, "operator", {}, InputKind::kLatest);
  std::vector<InputPort*> inputs{&robot_state_, &operator_};
  if (stride_port_) {
    wiring->AddInput(&stride_, "stride", {});
    inputs.push_back(&stride_);
  }
  wiring->AddOutput(&support_plan_, "support_plan", FootCounts(*model_));
  wiring->AddOutput(&planner_status_, "planner_status", FootCounts(*model_));
  std::vector<OutputPort*> outputs{&support_plan_, &planner_status_};
  if (has_recovery_ || walks_quasi_static_) {
    wiring->AddOutput(&footsteps_, "footsteps", {});
    footsteps_->stance = -1;
    outputs.push_back(&footsteps_);
  }
  wiring->AddStage("plan", std::move(inputs), std::move(outputs), [this](const Tick& tick) {
    if (stride_port_ && stride_.present()) planned_ = CommandOf(*stride_);
    TakeActs(tick);
    support_plan_->status = Plan(tick.time);
  });
  support_plan_t& plan = *support_plan_;
  planner_status_t& status = *planner_status_;
  plan.transition_foot = status.step_foot = -1;
  status.next_phase = schedule_->next();
  status.phase_left = -1;
  SetMotion(RotationMotion(), &plan.body_reference);
  for (const Foot f : kFeet) {
    plan.in_contact[Index(f)] = status.next_in_contact[Index(f)] = in_contact_[f] ? 1 : 0;
    SetPose(Eigen::Isometry3d::Identity(), &status.foot_pose[Index(f)]);
    SetMotion(RotationMotion(), &plan.foot_rotation_reference[Index(f)]);
  }
}

void StepPlanner::ConfigureLimits(const StepPlannerConfig& config) {
  tilts_ = config.hip_strategy().enabled();
  for (const Foot f : kFeet) {
    const robot::FootModel& foot = model_->feet()[f];
    if (tilts_ && HipStrategy::kStart >= robot::InnerRadius(foot)) {
      throw ConfigError("hip_strategy.enabled",
                        fmt::format("is true: the body turns {} m inside the soles' edge, which "
                                    "leaves nothing of the {} foot's, {} x {} m",
                                    HipStrategy::kStart, foot.name, foot.length, foot.width));
    }
    sole_[f] = balance::SolePolygon(foot, 0);
    if (tilts_) tilt_sole_[f] = balance::SolePolygon(foot, HipStrategy::kStart);
    stance_sole_[f] = StanceSole(foot);
  }
}

bool StepPlanner::Archive(StateArchive* archive) {
  archive->Show(operator_, operator_walk_, *schedule_, generator_, stance_follower_, hip_strategy_,
                references_, in_contact_, has_tasks_, owner_, untilted_, was_free_, step_needed_,
                planned_, recovery_, walk_, footstep_report_);
  for (const Foot f : kFeet) archive->Show(landing_[f], contact_loss_[f]);
  ArchiveMessage(&*support_plan_, archive);
  ArchiveMessage(&*planner_status_, archive);
  if (has_recovery_ || walks_quasi_static_) ArchiveMessage(&*footsteps_, archive);
  return true;
}

void StepPlanner::TakeActs(const Tick& tick) {
  while (const operate::act_t* const act = operator_.Next(tick)) {
    operator_.Answer(Act(*act, tick.time));
  }
}

int8_t StepPlanner::Act(const operate::act_t& act, double time) {
  using operate::act_t;
  using operate::answer_t;
  switch (act.kind) {
    case act_t::KIND_WALK:
      if (!walks_quasi_static_ && !walks_dynamically_) return answer_t::VERDICT_NOT_ABLE;
      for (int i = 0; i < 3; ++i) {
        if (!(std::abs(act.velocity[i]) <= kFastestWalk)) return answer_t::VERDICT_RANGE;
      }
      operator_walk_ = {.given = true, .stepping = true};
      std::copy_n(act.velocity, 3, operator_walk_.velocity);
      return answer_t::VERDICT_DONE;
    case act_t::KIND_STAND:
      if (!walks_quasi_static_ && !has_recovery_) return answer_t::VERDICT_NOT_ABLE;
      if (has_recovery_ && owner_ != FeetOwner::kWalk) {
        const bool stands = Count(in_contact_) == 2 && has_tasks_;
        const bool rests = stands && owner_ != FeetOwner::kRecovery;
        if (!walks_quasi_static_ && !rests && !recovery_.command().stepping) {
          return answer_t::VERDICT_NOT_NOW;
        }
        if (rests) recovery_.BringTogether();
      }
      operator_walk_ = {.given = true};
      return answer_t::VERDICT_DONE;
    case act_t::KIND_STEP: {
      if (!walks_quasi_static_ && !walks_dynamically_) return answer_t::VERDICT_NOT_ABLE;
      if (act.foot >= static_cast<int>(kFeet.size())) return answer_t::VERDICT_UNKNOWN;
      const bool stands = Count(in_contact_) == 2 && has_tasks_;
      if (!stands || Steps() != nullptr) return answer_t::VERDICT_NOT_NOW;
      operator_walk_ = {.given = true, .one_step = true, .steps_before = NumSteps()};
      // Walking begins with the foot of the side that it goes to.
      if (robot::FootAt(act.foot) == Foot::kLeft) operator_walk_.velocity[1] = kLeftFirst;
      return answer_t::VERDICT_DONE;
    }
    case act_t::KIND_NEXT_PHASE:
      return !Held() && schedule_->EndNow(time) ? answer_t::VERDICT_DONE
                                                : answer_t::VERDICT_NOT_NOW;
    default:
      return answer_t::VERDICT_UNKNOWN;
  }
}

stepping::WalkCommand StepPlanner::WalkCommandAt(double time) const {
  const int begun = walks_dynamically_ ? recovery_.num_begun() : walk_.num_begun();
  if (!operator_walk_.given) return stride_port_ ? planned_ : walk_commands_.At(time, begun);
  const double* const v = operator_walk_.velocity;
  bool stepping = operator_walk_.stepping;
  // A recovery counts a step as it begins, a walk as it ends.
  if (operator_walk_.one_step && NumSteps() == operator_walk_.steps_before) {
    const stepping::Stage stage = walk_.stage();
    stepping = stage != stepping::Stage::kSwinging && stage != stepping::Stage::kTouching;
  }
  if (!stepping) return {};
  return {{v[0], v[1]}, v[2], true};
}

int8_t StepPlanner::Plan(double time) {
  const robot::FootArray<double> load{-robot_state_->foot_wrench[0].force[2],
                                      -robot_state_->foot_wrench[1].force[2]};
  if (!ReadState(*robot_state_, &state_) ||
      !std::isfinite(load[Foot::kRight] + load[Foot::kLeft])) {
    return support_plan_t::STATUS_INVALID_STATE;
  }
  whole_body_->UpdateDynamics(state_);
  const ScheduleInput observed = Observe(time, load);
  ChooseOwner(time, load);
  if (Held()) {
    schedule_->Hold(time);
  } else if (schedule_->Advance(observed).phase_began) {
    BeginPhase(time);
  }
  FollowSoles(time);
  const Capture capture = ComputeCapture();
  UpdateReferences(time, capture);
  Report(time, capture);
  return schedule_->state().waiting() && !Held() ? support_plan_t::STATUS_WAITING
                                                 : support_plan_t::STATUS_OK;
}

ScheduleInput StepPlanner::Observe(double time, const robot::FootArray<double>& load) {
  ScheduleInput input{.time = time, .can_carry_alone = CanCarryAlone()};
  for (const Foot f : kFeet) {
    const double deviation = LoadDeviation(f);
    landing_[f].Measure(time, load[f], deviation);
    contact_loss_[f].Update(time, load[f],
                            in_contact_[f] && schedule_->state().transition_foot != f, deviation);
    input.foot_confirmed[f] = landing_[f].confirmed();
    input.contact_lost[f] = contact_loss_[f].lost();
    input.no_surface = input.no_surface || (!in_contact_[f] && landing_[f].found_none());
  }
  return input;
}

double StepPlanner::LoadDeviation(Foot foot) const {
  return robot_state_->foot_wrench_source[Index(foot)] == robot_state_t::SOURCE_OBSERVER
             ? robot_state_->foot_wrench_deviation[Index(foot)].force[2]
             : 0;
}

void StepPlanner::ChooseOwner(double time, const robot::FootArray<double>& load) {
  if (!has_recovery_ && !walks_quasi_static_) return;
  const stepping::StepInput input = MakeStepInput(time, load);
  if (has_recovery_ && (owner_ != FeetOwner::kWalk || walk_.Lost(input)) &&
      recovery_.Update(input)) {
    HandOver(FeetOwner::kRecovery, time);
    walk_.Stop(time);
  } else if (walks_quasi_static_ && walk_.Update(input, WalkCommandAt(time))) {
    HandOver(FeetOwner::kWalk, time);
  } else if (const stepping::StepOutput* last = Steps(); last != nullptr) {
    const bool as_planned = ContactsOf(schedule_->phase().support()) == last->in_contact;
    HandOver(as_planned ? FeetOwner::kPhases : FeetOwner::kStance, time);
  }
  const stepping::StepOutput* const steps = Steps();
  if (steps == nullptr) return;
  in_contact_ = steps->in_contact;
  for (ContactLoss& loss : contact_loss_) loss.Reset();
}

void StepPlanner::HandOver(FeetOwner to, double time) {
  const FeetOwner from = owner_;
  if (from == to) return;
  // A recovery takes over a walk's references as they are; the phases need references at rest.
  const bool ends =
      from == FeetOwner::kRecovery || (from == FeetOwner::kWalk && to != FeetOwner::kRecovery);
  if (ends) EndSteps(*Steps(), time);
  // The body stays where the walk has turned it.
  if (from == FeetOwner::kWalk || (from == FeetOwner::kRecovery && recovery_.turns())) {
    generator_.HoldBody(untilted_);
  }
  owner_ = to;
}

stepping::StepInput StepPlanner::MakeStepInput(double time, const robot::FootArray<double>& load) {
  const robot::RobotData& data = whole_body_->data();
  stepping::StepInput input;
  input.time = time;
  input.com = data.com;
  input.com_velocity = data.com_velocity;
  input.angular_momentum = whole_body_->AngularMomentum() / data.total_mass;
  const Eigen::AngleAxisd lean(data.body_rotation[static_cast<size_t>(model_->body_task_body())] *
                               references_.body.rotation.transpose());
  input.lean = lean.angle() * lean.axis();
  input.turning = data.body_angular_velocity[static_cast<size_t>(model_->body_task_body())];
  input.sole = data.foot_pose;
  input.load = load;
  for (const Foot f : kFeet) input.load_deviation[f] = LoadDeviation(f);
  input.in_contact = in_contact_;
  input.com_height = references_.com.position.z();
  input.step_needed = planner_status_->step_needed != 0;
  input.allowed = has_tasks_;
  if (walks_dynamically_) input.command = WalkCommandAt(time);
  for (const Foot f : kFeet) {
    if (in_contact_[f]) continue;
    input.free_foot = references_.foot[f];
    input.free_rotation = references_.foot_rotation[f].rotation;
  }
  return input;
}

const stepping::StepOutput* StepPlanner::Steps() const {
  return owner_ == FeetOwner::kRecovery ? &recovery_.output()
         : owner_ == FeetOwner::kWalk   ? &walk_.output()
                                        : nullptr;
}

void StepPlanner::EndSteps(const stepping::StepOutput& steps, double time) {
  in_contact_ = steps.in_contact;
  const EstimatedPose estimate = Estimate();
  Eigen::Vector3d rest =
      0.5 * (estimate.sole[Foot::kRight].translation() + estimate.sole[Foot::kLeft].translation());
  // In x and y the COM has followed a centre of pressure: its reference begins where it is.
  const robot::RobotData& data = whole_body_->data();
  PointMotion com;
  com.position << data.com.head<2>(), steps.com.position.z();
  com.velocity << data.com_velocity.head<2>(), steps.com.velocity.z();
  rest.z() = com.position.z();
  generator_.Anchor(estimate, com, rest, time, kSettleTime);
}

void StepPlanner::BeginPhase(double time) {
  const Phase& phase = schedule_->phase();
  const EstimatedPose estimate = Estimate();
  const ScheduleState& schedule = schedule_->state();
  const ComReference::Target com = phase.com().target();
  const bool above_soles =
      phase.has_com() && com != ComReference::HOLD && com != ComReference::SHIFT;
  if (above_soles) stance_follower_.Restart();
  // The first phase begins with the run; its moves wait for the scenario's time 0.
  generator_.BeginPhase(phase, estimate, schedule.first ? std::max(time, 0.0) : time);
  const robot::FootArray<bool> last_contact = in_contact_;
  in_contact_ = ContactsOf(phase.support());
  for (const Foot f : kFeet) {
    contact_loss_[f].Reset();
    if (in_contact_[f]) continue;
    was_free_ = true;
    if (last_contact[f] || !has_tasks_) {
      references_.foot[f].position = estimate.sole[f].translation();
      references_.foot_rotation[f].rotation = estimate.sole[f].linear();
      landing_[f].LiftOff(references_.foot[f].position.z());
    } else if (schedule.began_by != DONE) {
      landing_[f].Release();
    }
    const bool moves = phase.has_foot() && robot::FootAt(phase.foot().foot()) == f;
    const PointMotion& standing = references_.foot[f];
    if (moves && !landing_[f].BeginMove(standing.position.z(), generator_.foot(f).target().z(),
                                        generator_.foot(f).end())) {
      generator_.HoldFoot(f, standing.position, references_.foot_rotation[f].rotation);
    }
  }
  has_tasks_ = !phase.gravity_compensation();
}

void StepPlanner::Report(double time, const Capture& capture) {
  planner_status_t* const status = &*planner_status_;
  const EstimatedPose estimate = Estimate();
  const SupportView view{.schedule = *schedule_,
                         .held = Held(),
                         .steps = Steps(),
                         .in_contact = in_contact_,
                         .landing = landing_};
  FillSupportPlan(view, estimate, references_, &*support_plan_);
  status->feet_owner = static_cast<int8_t>(owner_);
  ReportPhase(view, time, status);
  ReportRobot(view, whole_body_->data(), status);
  const balance::ConvexPolygon soles =
      capture.known ? Soles(capture.frame_o, sole_) : balance::ConvexPolygon();
  if (soles.num_corners > 0) {
    MonitorCapture(time, capture.frame_o, soles, capture.pendulum, &step_needed_, status);
  }
  if (!has_recovery_ && !walks_quasi_static_) return;
  const bool walking = walks_quasi_static_ && owner_ != FeetOwner::kRecovery;
  ReportStepping(walking ? walk_.status() : recovery_.status(),
                 walking && walk_.active() ? walk_.command() : recovery_.command(), time,
                 estimate.sole, status);
  status->num_steps = recovery_.num_begun() + walk_.num_begun();
  const FootstepInput input{.time = time,
                            .com_height = estimate.com.z(),
                            .sole = estimate.sole,
                            .in_contact = in_contact_};
  footstep_report_.Update(input, has_recovery_ ? &recovery_ : nullptr,
                          walks_quasi_static_ ? &walk_ : nullptr, &*footsteps_);
}

StepPlanner::Capture StepPlanner::ComputeCapture() const {
  const robot::RobotData& data = whole_body_->data();
  const balance::ContactGeometry geometry = Geometry();
  Capture capture;
  capture.known =
      balance::FrameO(geometry.sole, geometry.in_contact, &capture.frame_o) &&
      balance::ComputeCapturePoint(capture.frame_o, data.com, data.com_velocity,
                                   Eigen::Vector3d::Zero(), robot::kGravity, &capture.pendulum);
  return capture;
}

void StepPlanner::FollowSoles(double time) {
  const EstimatedPose estimate = Estimate();
  const StanceFollower::Stance stance{
      .sole = {estimate.sole[Foot::kRight].translation(), estimate.sole[Foot::kLeft].translation()},
      .com = generator_.com_target(),
      .planned = Count(in_contact_) == 2 && has_tasks_ && !Held() && !was_free_,
      .carried = robot_state_->foot_load_share[0] > 0 && robot_state_->foot_load_share[1] > 0,
      .resting = generator_.ComMoveEnded(time)};
  const Eigen::Vector3d way = stance_follower_.Update(time, stance);
  if (!way.isZero(0)) generator_.ShiftCom(way, time, kSettleTime);
}

void StepPlanner::UpdateReferences(double time, const Capture& capture) {
  const robot::RobotData& data = whole_body_->data();
  references_ = generator_.Update(time, data.com);
  if (schedule_->phase().gravity_compensation()) return;
  if (const stepping::StepOutput* steps = Steps(); steps != nullptr) {
    references_.com = steps->com;
    for (const Foot f : kFeet) {
      if (in_contact_[f]) continue;
      references_.foot[f] = steps->swing;
      references_.foot_rotation[f] = steps->swing_rotation;
    }
    if (owner_ == FeetOwner::kWalk) TurnBody(walk_.body_yaw());
    if (owner_ == FeetOwner::kRecovery && recovery_.turns()) TurnBody(recovery_.body_yaw());
    untilted_ = references_.body.rotation;
    if (tilts_) TiltBody(time, capture);
    return;
  }
  const bool due = schedule_->state().waiting_for == WaitingFor::kContact;
  for (const Foot f : kFeet) {
    if (in_contact_[f]) continue;
    PointMotion* foot = &references_.foot[f];
    Eigen::Matrix3d* rotation = &references_.foot_rotation[f].rotation;
    if (landing_[f].Update(schedule_->BeforeTouchDown(), due, data.foot_pose[f], foot, rotation)) {
      // Where the landing ends, the plan goes on from here.
      generator_.HoldFoot(f, foot->position, *rotation);
      references_.foot_rotation[f] = {.rotation = *rotation};
    }
  }
  if (tilts_) TiltBody(time, capture);
}

void StepPlanner::TurnBody(const Quintic::Point& yaw) {
  const Eigen::AngleAxisd turn(yaw.position, Eigen::Vector3d::UnitZ());
  references_.body.rotation = turn * references_.body.rotation;
  references_.body.angular_velocity.z() += yaw.velocity;
  references_.body.angular_acceleration.z() += yaw.acceleration;
}

void StepPlanner::TiltBody(double time, const Capture& capture) {
  HipInput input{.time = time, .near_joint_limit = NearJointLimit()};
  if (capture.known) {
    const balance::ConvexPolygon region = Soles(capture.frame_o, tilt_sole_);
    if (region.num_corners > 0) {
      const Eigen::Vector2d& point = capture.pendulum.position;
      const Eigen::Vector2d out = point - balance::NearestPoint(region, point);
      input.excess = capture.frame_o.linear().leftCols<2>() * out;
      input.excess.z() = 0;
      input.margin = balance::SignedDistance(region, point);
    }
  }
  // The turning body takes of the centre of pressure that a step needs.
  if (has_recovery_ && recovery_.would_step()) input.excess.setZero();
  // About one axis the rotation vector's derivatives are the angular velocity and acceleration; of
  // a turn that goes over into another, or comes upon the plan's own, only nearly.
  const PointMotion tilt = hip_strategy_.Update(input);
  const double angle = tilt.position.norm();
  if (angle > 0) {
    references_.body.rotation =
        Eigen::AngleAxisd(angle, tilt.position / angle) * references_.body.rotation;
  }
  references_.body.angular_velocity += tilt.velocity;
  references_.body.angular_acceleration += tilt.acceleration;
}

bool StepPlanner::NearJointLimit() const {
  for (const Foot f : kFeet) {
    if (!in_contact_[f]) continue;
    for (const int joint : model_->supporting_joints(model_->feet()[f].body)) {
      const robot::Joint& limits = model_->joints()[static_cast<size_t>(joint)];
      const double position = state_.joint_position[joint], speed = state_.joint_velocity[joint];
      const double room = speed > 0 ? limits.upper - position : position - limits.lower;
      // At an even deceleration a joint goes on for half of the time that braking takes.
      if (0.5 * HipStrategy::kBrakeTime * std::abs(speed) > room - kLeastJointMargin) return true;
    }
  }
  return false;
}

EstimatedPose StepPlanner::Estimate() const {
  const robot::RobotData& data = whole_body_->data();
  return {.com = data.com,
          .body_rotation = data.body_rotation[static_cast<size_t>(model_->body_task_body())],
          .sole = data.foot_pose};
}

balance::ContactGeometry StepPlanner::Geometry() const {
  const robot::RobotData& data = whole_body_->data();
  return {data.foot_pose, in_contact_};
}

balance::ConvexPolygon StepPlanner::Soles(
    const Eigen::Isometry3d& frame_o, const robot::FootArray<balance::ConvexPolygon>& sole) const {
  return balance::SupportPolygon(frame_o, Geometry(), sole);
}

robot::FootArray<bool> StepPlanner::CanCarryAlone() const {
  const robot::RobotData& data = whole_body_->data();
  robot::FootArray<bool> over;
  for (const Foot f : kFeet) {
    const Eigen::Isometry3d& sole = data.foot_pose[f];
    // Along the vertical onto the sole's plane, then into its axes.
    const Eigen::Vector3d normal = sole.linear().col(2);
    Eigen::Vector3d offset = data.com - sole.translation();
    if (!(offset.z() > 0)) continue;
    offset += std::sqrt(offset.z() / robot::kGravity) * data.com_velocity;
    offset.z() -= offset.dot(normal) / normal.z();
    const Eigen::Vector2d at = (sole.linear().transpose() * offset).head<2>();
    over[f] = balance::Contains(stance_sole_[f], at);
  }
  return over;
}

ComponentType StepPlannerType() {
  AddOptionalPort({.component = "step_planner",
                   .port = "footsteps",
                   .type = MessageTraits<::steps::footsteps_t>::kName,
                   .when = {"step_planner.recovery.enabled", "step_planner.walk.enabled"},
                   .brings_channel = true});
  AddOptionalPort({.component = "step_planner",
                   .port = "stride",
                   .type = MessageTraits<::steps::stride_t>::kName,
                   .when = {"step_planner.walk.stride_port"},
                   .input = true});
  return {
      "step_planner",
      "which feet carry, and where COM, body and feet go: phases, capture point",
      [] { return std::make_unique<StepPlanner>(); },
      {},
      {Reads<robot_state_t>("robot_state"), Reads<operate::act_t>("operator", InputKind::kLatest),
       Writes<support_plan_t>("support_plan"), Writes<planner_status_t>("planner_status")},
      StepPlannerConfig::descriptor(),
      step_planner_proto_schema};
}

}  // namespace poise
