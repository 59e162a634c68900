#include "components/task_controller/task_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/balance/capture_point.h"
#include "components/balance/support_polygon.h"
#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"
#include "components/task_controller/task_controller_type.h"

namespace poise {
namespace {

PdGains ReadGains(const Gains& gains) { return {gains.kp(), gains.kd()}; }

int8_t TransitionCode(TransitionKind kind) {
  switch (kind) {
    case TransitionKind::kUnloading:
      return task_torque_t::TRANSITION_UNLOADING;
    case TransitionKind::kLoading:
      return task_torque_t::TRANSITION_LOADING;
    case TransitionKind::kNone:
      break;
  }
  return task_torque_t::TRANSITION_NONE;
}

int8_t FootCode(Landing::State state) {
  switch (state) {
    case Landing::State::kSearching:
      return task_torque_t::FOOT_SEARCHING;
    case Landing::State::kTouching:
      return task_torque_t::FOOT_TOUCHING;
    case Landing::State::kRetracted:
      return task_torque_t::FOOT_RETRACTED;
    case Landing::State::kSwing:
      break;
  }
  return task_torque_t::FOOT_SWING;
}

// The paper's distance of the limits from the edges of its sole, m.
constexpr double kLengthReserve = 0.03, kWidthReserve = 0.025;

double ReadStanceHalf(bool given, double value, double sole, double reserve, const char* field) {
  if (!given) return std::max(0.5 * sole - reserve, 0.25 * sole);
  if (!(value > 0 && value <= 0.5 * sole)) {
    throw ConfigError(field, fmt::format("is {}; must be above 0 and at most the sole's {} m",
                                         value, 0.5 * sole));
  }
  return value;
}

// Rows that the tasks and contacts of a support determine; every velocity is determined when they
// are n.
int DeterminedRows(const std::array<bool, 2>& in_contact) {
  return TaskStack::NumRows(in_contact) + (in_contact[0] ? 6 : 0) + (in_contact[1] ? 6 : 0);
}

}  // namespace

void TaskController::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<TaskControllerConfig>();
  CheckTaskControllerConfig(config);
  model_ = LoadRobot(context);
  const int num_joints = model_->num_joints();
  for (int i = 0; i < config.phase_size(); ++i) {
    const std::array<bool, 2> in_contact = ContactsOf(config.phase(i).support());
    const int free = model_->num_velocities() - DeterminedRows(in_contact);
    if (config.phase(i).gravity_compensation()) continue;
    if (free < 0) {
      throw ConfigError(fmt::format("phase[{}].support", i),
                        fmt::format("needs {} joints, robot '{}' has {}", num_joints - free,
                                    model_->name(), num_joints));
    }
    if (free > 0 && !config.has_posture()) {
      throw ConfigError("posture", fmt::format("is missing; the tasks of phase[{}] leave {} joint "
                                               "motions of robot '{}' free: give kp and kd",
                                               i, free, model_->name()));
    }
  }

  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  schedule_.emplace(config);
  generator_.emplace(config.com_lag());
  const HipStrategyConfig& hip = config.hip_strategy();
  CheckHipStrategyConfig(hip);
  for (const robot::FootModel& foot : model_->feet()) {
    if (hip.start() >= 0.5 * std::min(foot.length, foot.width)) {
      throw ConfigError("hip_strategy.start",
                        fmt::format("is {} m and leaves nothing of the {} foot's sole, {} x {} m",
                                    hip.start(), foot.name, foot.length, foot.width));
    }
  }
  hip_strategy_.emplace(hip);
  joint_reserve_ = hip.joint_reserve();
  brake_time_ = hip.brake_time();
  landing_.assign(2, Landing(config.contact()));
  tasks_.emplace(*model_, ReadGains(config.com()), ReadGains(config.orientation()),
                 ReadGains(config.foot()));
  task_dynamics_.emplace(num_joints, TaskStack::kMaxRows);
  posture_ = ReadGains(config.posture());
  for (size_t i = 0; i < 2; ++i) {
    const robot::FootModel& foot = model_->feet()[i];
    stance_half_[i] = {ReadStanceHalf(config.has_stance_half_length(), config.stance_half_length(),
                                      foot.length, kLengthReserve, "stance_half_length"),
                       ReadStanceHalf(config.has_stance_half_width(), config.stance_half_width(),
                                      foot.width, kWidthReserve, "stance_half_width")};
  }
  state_ = robot::RobotState(num_joints);
  in_contact_ = ContactsOf(config.phase(0).support());
  posture_reference_ = posture_acceleration_ = posture_torque_ = torque_ =
      Eigen::VectorXd::Zero(num_joints);

  const MessageCounts counts = JointAndFootCounts(*model_);
  wiring->AddInput(&robot_state_, "robot_state", counts);
  wiring->AddOutput(&task_torque_, "task_torque", counts);
  wiring->AddStage("control", {&robot_state_}, {&task_torque_},
                   [this](const Tick& tick) { Step(tick); });
  task_torque_->transition_foot = -1;
  for (size_t i = 0; i < 2; ++i) {
    task_torque_->in_contact[i] = in_contact_[i] ? 1 : 0;
    SetPose(Eigen::Isometry3d::Identity(), &task_torque_->foot_pose[i]);
    SetPose(Eigen::Isometry3d::Identity(), &task_torque_->foot_desired[i]);
  }
}

bool TaskController::Archive(StateArchive* archive) {
  schedule_->Archive(archive);
  generator_->Archive(archive);
  hip_strategy_->Archive(archive);
  for (Landing& landing : landing_) landing.Archive(archive);
  references_.Archive(archive);
  archive->Show(in_contact_, started_, last_controlled_, posture_reference_);
  ArchiveMessage(&*task_torque_, archive);
  return true;
}

void TaskController::Step(const Tick& tick) { task_torque_->status = Control(tick.time); }

int8_t TaskController::Control(double time) {
  const std::array<double, 2> load{-robot_state_->foot_wrench[0].force[2],
                                   -robot_state_->foot_wrench[1].force[2]};
  if (!ReadState(*robot_state_, &state_) || !std::isfinite(load[0] + load[1])) {
    return task_torque_t::STATUS_INVALID_STATE;
  }
  // The schedule needs the COM, which comes with the dynamics of the contacts so far; they seldom
  // change.
  if (!whole_body_->Update(state_, in_contact_)) return task_torque_t::STATUS_SINGULAR;
  if (!started_) {
    started_ = true;
    posture_reference_ = state_.joint_position;
  }
  for (size_t i = 0; i < 2; ++i) landing_[i].Measure(time, load[i]);
  const ScheduleState& schedule =
      schedule_->Advance(time, ComOverFoot(), {landing_[0].confirmed(), landing_[1].confirmed()});
  if (schedule.phase_began && !BeginPhase(time)) return task_torque_t::STATUS_SINGULAR;
  UpdateReferences(time);
  if (schedule_->phase().gravity_compensation()) {
    balance::GravityCompensation(whole_body_->contact(), torque_);
    posture_reference_ = state_.joint_position;
  } else if (!ComputeTorque(references_, in_contact_)) {
    return task_torque_t::STATUS_SINGULAR;
  }
  if (!torque_.allFinite()) return task_torque_t::STATUS_SINGULAR;
  Report(references_, in_contact_);
  return schedule.waiting() ? task_torque_t::STATUS_WAITING : task_torque_t::STATUS_OK;
}

bool TaskController::BeginPhase(double time) {
  const Phase& phase = schedule_->phase();
  const EstimatedPose estimate = Estimate();
  // The first phase begins with the run; its moves wait for the scenario's time 0.
  const bool first = schedule_->state().phase == 0;
  generator_->BeginPhase(phase, estimate, first ? std::max(time, 0.0) : time);
  const std::array<bool, 2> last_contact = in_contact_;
  in_contact_ = ContactsOf(phase.support());
  for (size_t i = 0; i < 2; ++i) {
    if (in_contact_[i]) continue;
    if (last_contact[i] || !last_controlled_) {
      references_.foot[i].position = estimate.sole[i].translation();
      references_.foot_rotation[i] = estimate.sole[i].linear();
      landing_[i].LiftOff(references_.foot[i].position.z());
    }
    const bool moves = phase.has_foot() && static_cast<size_t>(phase.foot().foot()) == i;
    const PointMotion& standing = references_.foot[i];
    if (moves && !landing_[i].BeginMove(standing.position.z(), generator_->foot(i).target().z(),
                                        generator_->foot(i).end())) {
      generator_->HoldFoot(i, standing.position, references_.foot_rotation[i]);
    }
  }
  last_controlled_ = !phase.gravity_compensation();
  return whole_body_->Update(state_, in_contact_);
}

void TaskController::UpdateReferences(double time) {
  references_ = generator_->Update(time, whole_body_->data().com);
  if (schedule_->phase().gravity_compensation()) return;
  const bool due = schedule_->state().waiting_for == WaitingFor::kContact;
  for (size_t i = 0; i < 2; ++i) {
    if (in_contact_[i]) continue;
    PointMotion* foot = &references_.foot[i];
    Eigen::Matrix3d* rotation = &references_.foot_rotation[i];
    if (landing_[i].Update(schedule_->BeforeTouchDown(), due, whole_body_->data().foot_pose[i],
                           foot, rotation)) {
      // Where the landing ends, the scenario goes on from here.
      generator_->HoldFoot(i, foot->position, *rotation);
    }
  }
  if (hip_strategy_->enabled()) TiltBody(time);
}

void TaskController::TiltBody(double time) {
  const robot::RobotData& data = whole_body_->data();
  const balance::ContactGeometry geometry = whole_body_->geometry();
  HipInput input{.time = time, .near_joint_limit = NearJointLimit()};
  std::array<Eigen::Vector2d, 2> half;
  for (size_t i = 0; i < 2; ++i) {
    const robot::FootModel& foot = model_->feet()[i];
    half[i] = {0.5 * foot.length - hip_strategy_->start(),
               0.5 * foot.width - hip_strategy_->start()};
  }
  Eigen::Isometry3d frame_o;
  balance::CapturePoint capture;
  if (balance::FrameO(geometry.sole, geometry.in_contact, &frame_o) &&
      balance::ComputeCapturePoint(frame_o, data.com, data.com_velocity, Eigen::Vector3d::Zero(),
                                   robot::kGravity, &capture)) {
    const balance::ConvexPolygon region = balance::SupportPolygon(frame_o, geometry, half);
    if (region.num_corners > 0) {
      const Eigen::Vector2d out =
          capture.position - balance::NearestPoint(region, capture.position);
      input.excess = frame_o.linear().leftCols<2>() * out;
      input.excess.z() = 0;
      input.margin = balance::SignedDistance(region, capture.position);
    }
  }
  // About one axis the rotation vector's derivatives are the angular velocity and acceleration; of
  // a turn that goes over into another only nearly.
  const PointMotion tilt = hip_strategy_->Update(input);
  const double angle = tilt.position.norm();
  if (angle > 0) {
    references_.body_rotation =
        Eigen::AngleAxisd(angle, tilt.position / angle) * references_.body_rotation;
  }
  references_.body_angular_velocity = tilt.velocity;
  references_.body_angular_acceleration = tilt.acceleration;
}

bool TaskController::NearJointLimit() const {
  for (size_t i = 0; i < 2; ++i) {
    if (!in_contact_[i]) continue;
    for (const int joint : model_->supporting_joints(model_->feet()[i].body)) {
      const robot::Joint& limits = model_->joints()[static_cast<size_t>(joint)];
      const double position = state_.joint_position[joint], speed = state_.joint_velocity[joint];
      const double room = speed > 0 ? limits.upper - position : position - limits.lower;
      // At an even deceleration a joint goes on for half of brake_time.
      if (0.5 * brake_time_ * std::abs(speed) > room - joint_reserve_) return true;
    }
  }
  return false;
}

int8_t TaskController::WaitingCode() const {
  switch (schedule_->state().waiting_for) {
    case WaitingFor::kCom:
      return task_torque_t::WAITING_COM;
    case WaitingFor::kContact:
      for (size_t i = 0; i < 2; ++i) {
        if (!in_contact_[i] && landing_[i].state() == Landing::State::kRetracted) {
          return task_torque_t::WAITING_NO_SURFACE;
        }
      }
      return task_torque_t::WAITING_CONTACT;
    case WaitingFor::kNothing:
      break;
  }
  return task_torque_t::WAITING_NONE;
}

EstimatedPose TaskController::Estimate() const {
  const robot::RobotData& data = whole_body_->data();
  return {.com = data.com,
          .body_rotation = data.body_rotation[static_cast<size_t>(model_->body_task_body())],
          .sole = {data.foot_pose[0], data.foot_pose[1]}};
}

std::array<bool, 2> TaskController::ComOverFoot() const {
  const robot::RobotData& data = whole_body_->data();
  std::array<bool, 2> over{};
  for (size_t i = 0; i < 2; ++i) {
    const Eigen::Isometry3d& sole = data.foot_pose[i];
    // Along the vertical onto the sole's plane, then into its axes.
    const Eigen::Vector3d normal = sole.linear().col(2);
    Eigen::Vector3d offset = data.com - sole.translation();
    if (!(offset.z() > 0)) continue;
    offset += std::sqrt(offset.z() / robot::kGravity) * data.com_velocity;
    offset.z() -= offset.dot(normal) / normal.z();
    const Eigen::Vector2d at = (sole.linear().transpose() * offset).head<2>();
    over[i] = std::abs(at.x()) <= stance_half_[i].x() && std::abs(at.y()) <= stance_half_[i].y();
  }
  return over;
}

bool TaskController::ComputeTorque(const References& references,
                                   const std::array<bool, 2>& in_contact) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  tasks_->Update(*model_, whole_body_->data(), references, in_contact);
  if (!task_dynamics_->Compute(contact, tasks_->jacobian(), tasks_->bias_acceleration())) {
    return false;
  }
  task_dynamics_->TaskTorque(tasks_->acceleration(), torque_);
  if (DeterminedRows(in_contact) < model_->num_velocities()) {
    // (28): what the tasks leave free is held up against gravity and drawn to the posture of the
    // start, the joints' own inertia as weight.
    posture_acceleration_ = posture_.kp * (posture_reference_ - state_.joint_position) -
                            posture_.kd * state_.joint_velocity;
    balance::GravityCompensation(contact, posture_torque_);
    const Eigen::Index k = posture_torque_.size();
    posture_torque_.noalias() +=
        whole_body_->data().mass_matrix.bottomRightCorner(k, k) * posture_acceleration_;
    task_dynamics_->ProjectIntoNullSpace(posture_torque_);
    torque_ += posture_torque_;
  }
  return true;
}

void TaskController::Report(const References& references, const std::array<bool, 2>& in_contact) {
  task_torque_t& out = *task_torque_;
  const robot::RobotData& data = whole_body_->data();
  const ScheduleState& schedule = schedule_->state();
  const bool controlled = !schedule_->phase().gravity_compensation();
  std::copy_n(torque_.data(), torque_.size(), out.torque.begin());
  out.phase = schedule.phase;
  out.waiting_for = WaitingCode();
  out.transition = TransitionCode(schedule.transition);
  out.transition_foot = static_cast<int8_t>(schedule.transition_foot);
  out.transition_progress = schedule.progress;
  SetVector3(data.com, out.com_position);
  SetVector3(data.com_velocity, out.com_velocity);
  SetVector3(controlled ? references.com.position : data.com, out.com_desired);
  SetVector3(controlled ? tasks_->body_orientation_error() : Eigen::Vector3d::Zero(),
             out.body_orientation_error);
  for (size_t i = 0; i < 2; ++i) {
    out.in_contact[i] = in_contact[i] ? 1 : 0;
    out.foot_state[i] = in_contact[i] ? task_torque_t::FOOT_SUPPORT : FootCode(landing_[i].state());
    SetPose(data.foot_pose[i], &out.foot_pose[i]);
    out.foot_desired[i] = out.foot_pose[i];
    if (controlled && !in_contact[i]) {
      Eigen::Isometry3d desired = Eigen::Isometry3d::Identity();
      desired.linear() = references.foot_rotation[i];
      desired.translation() = references.foot[i].position;
      SetPose(desired, &out.foot_desired[i]);
    }
  }
}

ComponentType TaskControllerType() {
  return {"task_controller", "phases, references and the task torque (24)",
          [] { return std::make_unique<TaskController>(); }};
}

}  // namespace poise
