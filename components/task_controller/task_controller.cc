#include "components/task_controller/task_controller.h"

#include <fmt/format.h>

#include <algorithm>

#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "components/messages/robot_resource.h"
#include "components/task_controller/task_controller.pb.h"

namespace poise {

std::string_view task_controller_proto_schema();  // generated
namespace {

using robot::Foot;
using robot::kFeet;

// Shares of the start's gains that an operator may go to: beyond, the delay of the drive train
// makes them unstable, or they hold nothing up. Chosen.
constexpr double kLeastGain = 0.25, kMostGain = 4;
// s in which a gain is gone through: a standing error is answered by no more than this slowly.
constexpr double kGainRamp = 0.5;

// A sole that turns with a joint by more than this share of its speed is what moves: on a sole that
// stands the body would.
constexpr double kSoleShare = 0.5;
// rad/s: slower, it may be the gears that yield.
constexpr double kSoleRate = 0.3;

/// Joints that are not between the base and a foot.
int NumOthers(const robot::RobotModel& model) {
  return static_cast<int>(model.num_joints() -
                          static_cast<int>(balance::MakeContactDynamics(model).legs().size()));
}

/// Throws ConfigError when the tasks cannot be met on these feet. `others`: joints that are not
/// theirs.
void CheckRows(const TaskList& tasks, const robot::RobotModel& model, const FeetInContact& feet,
               int others) {
  const char* support = Count(feet) == 2     ? "on both feet"
                        : feet[Foot::kRight] ? "on the right foot"
                                             : "on the left foot";
  const int motions = model.num_velocities() - others - 6 * Count(feet);
  const TaskList::Rows rows = tasks.CountRows(feet);
  if (rows.first > motions) {
    throw ConfigError("task", fmt::format("asks for {} motions on its first level, and robot '{}' "
                                          "has {} {}: put some on another level",
                                          rows.first, model.name(), motions, support));
  }
  if (rows.all == 0) {
    throw ConfigError("task", fmt::format("has none that does not rest {}: add one", support));
  }
}

}  // namespace

void TaskController::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<TaskControllerConfig>();
  model_ = LoadRobot(context);
  const int num_joints = model_->num_joints();
  gains_ = ReadStandingGains(config, balance::GainsByRule(*model_, context.tick_period));
  tasks_.emplace(config, model_, gains_);
  step_delay_ = balance::VelocityDelay(*model_, balance::StepCutoff(*model_));
  com_gains_ = gains_.com;
  if (!config.has_com()) soft_ground_.emplace(*model_, context.tick_period);
  base_share_ = balance::BaseVelocityShare(gains_.base_velocity_cutoff, context.tick_period);
  AddSettings(context.tick_period);
  const int others = config.task_size() == 0 ? NumOthers(*model_) : 0;
  others_held_ = others > 0;
  for (const FeetInContact& feet : {FeetInContact{true, true}, {true, false}, {false, true}}) {
    CheckRows(*tasks_, *model_, feet, others);
  }
  const balance::JointLimits limits(*model_, balance::LimitHorizon(*model_, context.tick_period));
  if (config.joint_limits()) limits_ = limits;
  for (int j = 0; j < num_joints; ++j) carries_.push_back(model_->CarriedFeet(j));

  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  posture_.emplace(limits, whole_body_->contact().legs(), context.tick_period);
  state_ = robot::RobotState(num_joints);
  posture_acceleration_ = posture_torque_ = torque_ = free_torque_ =
      Eigen::VectorXd::Zero(num_joints);
  acceleration_ = Eigen::VectorXd::Zero(model_->num_velocities());

  wiring->AddInput(&robot_state_, "robot_state", JointAndFootCounts(*model_));
  wiring->AddInput(&support_plan_, "support_plan", FootCounts(*model_));
  wiring->AddInput(&operator_, "operator", {}, InputKind::kLatest);
  wiring->AddOutput(&task_torque_, "task_torque", JointCounts(*model_));
  wiring->AddStage("prepare", {&robot_state_}, {}, [this](const Tick&) { Prepare(); });
  wiring->AddStage("control", {&robot_state_, &support_plan_, &operator_}, {&task_torque_},
                   [this](const Tick& tick) {
                     TakeActs(tick);
                     task_torque_->status = Control();
                   });
}

void TaskController::AddSettings(double tick_period) {
  LiveSettings& settings = operator_.settings() = LiveSettings(tick_period);
  const auto add = [&](const std::string& field, balance::TaskGains* gains) {
    settings.Add(field + ".kp", &gains->kp, kLeastGain * gains->kp, kMostGain * gains->kp,
                 kGainRamp);
    settings.Add(field + ".kd", &gains->kd, kLeastGain * gains->kd, kMostGain * gains->kd,
                 kGainRamp);
  };
  add("com", &gains_.com);
  add("orientation", &gains_.orientation);
  add("foot", &gains_.foot);
  add("posture", &gains_.posture);
}

void TaskController::TakeActs(const Tick& tick) {
  using operate::answer_t;
  while (const operate::act_t* const act = operator_.Next(tick)) {
    if (act->kind != operate::act_t::KIND_JOINT) {
      operator_.Answer(answer_t::VERDICT_UNKNOWN);
    } else if (!started_ || support_plan_->gravity_compensation != 0) {
      operator_.Answer(answer_t::VERDICT_NOT_NOW);
    } else {
      operator_.Answer(posture_->Move(*act, tick.time));
    }
  }
  posture_->Update(tick.time);
  if (operator_.settings().Advance(tick.index)) SetGains();
}

void TaskController::SetGains() {
  balance::StandingGains gains = gains_;
  if (soft_ground_) gains.com = soft_ground_->Limited(gains.com);
  com_gains_ = gains.com;
  tasks_->SetGains(gains);
}

void TaskController::FollowGround() {
  if (!soft_ground_) return;
  // The COM follows a centre of pressure in the planner's steps alone.
  const bool steps = support_plan_->com_follows == support_plan_t::FOLLOWS_COP;
  robot::FootArray<SoftGround::FootState> feet;
  for (const Foot f : kFeet) {
    feet[f].put_down = in_contact_[f] && !steps;
    feet[f].height = whole_body_->data().foot_pose[f].translation().z();
    feet[f].load = -robot_state_->foot_wrench[Index(f)].force[2];
  }
  soft_ground_->Update(feet);
  if (soft_ground_->Limited(gains_.com).kp != com_gains_.kp) SetGains();
}

bool TaskController::Archive(StateArchive* archive) {
  archive->Show(in_contact_, started_, base_velocity_);
  posture_->Archive(archive);
  operator_.Archive(archive);
  if (soft_ground_) soft_ground_->Archive(archive);
  if (archive->restoring()) SetGains();
  tasks_->Archive(archive);
  ArchiveMessage(&*task_torque_, archive);
  return true;
}

void TaskController::Prepare() {
  state_valid_ = ReadState(*robot_state_, &state_);
  // Contacts seldom change: with last tick's, the work is done before the plan arrives.
  if (state_valid_) whole_body_->Update(state_, in_contact_);
}

int8_t TaskController::Control() {
  const support_plan_t& plan = *support_plan_;
  const FeetInContact in_contact{plan.in_contact[0] != 0, plan.in_contact[1] != 0};
  if (!state_valid_ || plan.status == support_plan_t::STATUS_INVALID_STATE) {
    return task_torque_t::STATUS_INVALID_STATE;
  }
  in_contact_ = in_contact;
  if (!whole_body_->Update(state_, in_contact)) return task_torque_t::STATUS_SINGULAR;
  const bool steps = plan.com_follows == support_plan_t::FOLLOWS_COP;
  const balance::TaskState state{*model_, state_, whole_body_->data(), steps ? step_delay_ : 0};
  if (!started_ || plan.gravity_compensation != 0) {
    started_ = true;
    base_velocity_ << state_.base_linear_velocity, state_.base_angular_velocity;
    posture_->Hold(state_.joint_position);
    tasks_->Hold(state);
  }
  Eigen::Vector3d orientation_error = Eigen::Vector3d::Zero();
  if (plan.gravity_compensation != 0) {
    balance::GravityCompensation(whole_body_->contact(), torque_);
  } else {
    tasks_->Follow(plan);
    SmoothBase(plan);
    FollowGround();
    if (!ComputeTorque(state, in_contact)) return task_torque_t::STATUS_SINGULAR;
    const auto body = static_cast<size_t>(model_->body_task_body());
    orientation_error = balance::OrientationError(GetMotion(plan.body_reference).rotation,
                                                  state.data.body_rotation[body]);
  }
  if (!torque_.allFinite()) return task_torque_t::STATUS_SINGULAR;
  std::copy_n(torque_.data(), torque_.size(), task_torque_->torque.begin());
  SetVector3(orientation_error, task_torque_->body_orientation_error);
  return task_torque_t::STATUS_OK;
}

void TaskController::SmoothBase(const support_plan_t& plan) {
  if (base_share_ == 1) return;
  balance::Vector6d now;
  now << state_.base_linear_velocity, state_.base_angular_velocity;
  // Steps lead the capture point, which a late velocity would put elsewhere.
  const double share = plan.com_follows == support_plan_t::FOLLOWS_COP ? 1 : base_share_;
  base_velocity_ += share * (now - base_velocity_);
  tasks_->set_base_velocity_lag(now - base_velocity_);
}

void TaskController::ComputePosture() {
  posture_acceleration_ = gains_.posture.kp * (posture_->position() - state_.joint_position) -
                          gains_.posture.kd * (state_.joint_velocity - posture_->velocity()) +
                          posture_->acceleration();
  if (!limits_) return;
  for (int j = 0; j < posture_acceleration_.size(); ++j) {
    const balance::AccelerationRange range =
        limits_->Accelerations(j, state_.joint_position[j], state_.joint_velocity[j]);
    posture_acceleration_[j] = std::clamp(posture_acceleration_[j], range.lower, range.upper);
  }
}

bool TaskController::ComputeTasks(const balance::TaskState& state, const FeetInContact& in_contact,
                                  std::span<const TaskList::ForcedJoint> forced) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  if (!tasks_->Compute(state, contact, in_contact, others_held_ ? &posture_acceleration_ : nullptr,
                       forced)) {
    return false;
  }
  const balance::TaskHierarchy& hierarchy = tasks_->hierarchy();
  torque_ = hierarchy.torque();
  if (hierarchy.num_free() > 0) {
    // (28): what the tasks leave free is held up against gravity and drawn to the posture of the
    // start, the joints' own inertia as weight.
    balance::GravityCompensation(contact, posture_torque_);
    const Eigen::Index k = posture_torque_.size();
    posture_torque_.noalias() +=
        whole_body_->data().mass_matrix.bottomRightCorner(k, k) * posture_acceleration_;
    hierarchy.ProjectIntoNullSpace(posture_torque_);
    torque_ += posture_torque_;
  }
  return true;
}

bool TaskController::FindLimits() {
  bool have_acceleration = false, found = false;
  const std::span<const int> legs = whole_body_->contact().legs();
  for (int j = 0; j < model_->num_joints() && num_forced_ < forced_.size(); ++j) {
    if (others_held_ && std::ranges::find(legs, j) == legs.end()) continue;
    const auto is_joint = [&](const TaskList::ForcedJoint& forced) { return forced.joint == j; };
    const auto end = forced_.begin() + static_cast<std::ptrdiff_t>(num_forced_);
    if (std::any_of(forced_.begin(), end, is_joint)) continue;
    const double position = state_.joint_position[j], velocity = state_.joint_velocity[j];
    if (!limits_->Near(j, position, velocity) || SoleTurns(j)) continue;
    if (!have_acceleration) {
      whole_body_->contact().Acceleration(torque_, acceleration_);
      have_acceleration = true;
    }
    const balance::AccelerationRange range = Stands(j)
                                                 ? limits_->Stopping(j, position, velocity)
                                                 : limits_->Accelerations(j, position, velocity);
    const double most = limits_->range(j).acceleration, a = acceleration_[6 + j];
    // Only the side of a range that a limit narrows counts.
    const bool above = range.upper < most && a > range.upper;
    const bool below = range.lower > -most && a < range.lower;
    if (!above && !below) continue;
    forced_[num_forced_++] = {j, above ? range.upper : range.lower};
    found = true;
  }
  return found;
}

bool TaskController::Stands(int joint) const {
  const auto j = static_cast<size_t>(joint);
  return std::ranges::any_of(kFeet, [&](Foot f) { return in_contact_[f] && carries_[j][f]; });
}

bool TaskController::SoleTurns(int joint) const {
  const auto j = static_cast<size_t>(joint);
  const robot::RobotData& data = whole_body_->data();
  const double speed = state_.joint_velocity[joint];
  for (const Foot f : kFeet) {
    if (!in_contact_[f] || !carries_[j][f]) continue;
    const double turn = data.foot_velocity[f].tail<3>().dot(data.joint_axis[j]);
    if (std::abs(turn) > kSoleRate && turn * speed > kSoleShare * speed * speed) return true;
  }
  return false;
}

bool TaskController::ComputeTorque(const balance::TaskState& state,
                                   const FeetInContact& in_contact) {
  ComputePosture();
  num_forced_ = 0;
  if (!ComputeTasks(state, in_contact, {})) return false;
  // What stops one joint may drive another: a second round, then the bridge's own limits remain.
  for (int round = 0; limits_ && round < 2 && FindLimits(); ++round) {
    free_torque_ = torque_;
    if (!ComputeTasks(state, in_contact, {forced_.data(), num_forced_})) {
      torque_ = free_torque_;  // these joints cannot be stopped together on these contacts
      break;
    }
  }
  return true;
}

ComponentType TaskControllerType() {
  return {
      "task_controller",
      "the task torque (24) that follows the support plan",
      [] { return std::make_unique<TaskController>(); },
      {},
      {Reads<robot_state_t>("robot_state"), Reads<support_plan_t>("support_plan"),
       Reads<operate::act_t>("operator", InputKind::kLatest), Writes<task_torque_t>("task_torque")},
      TaskControllerConfig::descriptor(),
      task_controller_proto_schema};
}

}  // namespace poise
