#include "components/task_controller/task_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "components/messages/robot_resource.h"
#include "components/task_controller/task_controller.pb.h"
#include "components/task_controller/task_controller_type.h"

namespace poise {

std::string_view task_controller_proto_schema();  // generated
namespace {

// Rows that tasks and contacts determine, on one foot or two: COM and body, and each foot by its
// contact or by its task.
constexpr int kDeterminedRows = 18;

PdGains ReadGains(bool present, const Gains& gains, const char* field, const char* why) {
  if (!present) throw ConfigError(field, fmt::format("is missing; {}", why));
  const auto check = [&](bool has, double value, const char* name) {
    if (!has || !(value > 0) || !std::isfinite(value)) {
      throw ConfigError(fmt::format("{}.{}", field, name), "must be a positive number");
    }
  };
  check(gains.has_kp(), gains.kp(), "kp");
  check(gains.has_kd(), gains.kd(), "kd");
  return {gains.kp(), gains.kd()};
}

}  // namespace

void TaskController::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<TaskControllerConfig>();
  const PdGains com =
      ReadGains(config.has_com(), config.com(), "com", "give kp and kd of the COM's position");
  const PdGains orientation = ReadGains(config.has_orientation(), config.orientation(),
                                        "orientation", "give kp and kd of the body's orientation");
  const PdGains foot = ReadGains(config.has_foot(), config.foot(), "foot",
                                 "give kp and kd of the pose of a foot out of contact");
  if (config.has_posture()) posture_ = ReadGains(true, config.posture(), "posture", "");
  model_ = LoadRobot(context);
  const int num_joints = model_->num_joints();
  const int free = model_->num_velocities() - kDeterminedRows;
  if (free < 0) {
    throw ConfigError(fmt::format("the tasks need {} joints, robot '{}' has {}", num_joints - free,
                                  model_->name(), num_joints));
  }
  if (free > 0 && !config.has_posture()) {
    throw ConfigError("posture", fmt::format("is missing; the tasks leave {} joint motions of "
                                             "robot '{}' free: give kp and kd",
                                             free, model_->name()));
  }

  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
  tasks_.emplace(*model_, com, orientation, foot);
  task_dynamics_.emplace(num_joints, TaskStack::kMaxRows);
  state_ = robot::RobotState(num_joints);
  posture_reference_ = posture_acceleration_ = posture_torque_ = torque_ =
      Eigen::VectorXd::Zero(num_joints);

  wiring->AddInput(&robot_state_, "robot_state", JointAndFootCounts(*model_));
  wiring->AddInput(&support_plan_, "support_plan", FootCounts(*model_));
  wiring->AddOutput(&task_torque_, "task_torque", JointCounts(*model_));
  wiring->AddStage("prepare", {&robot_state_}, {}, [this](const Tick&) { Prepare(); });
  wiring->AddStage("control", {&robot_state_, &support_plan_}, {&task_torque_},
                   [this](const Tick&) { task_torque_->status = Control(); });
}

bool TaskController::Archive(StateArchive* archive) {
  archive->Show(in_contact_, started_, posture_reference_);
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
  const std::array<bool, 2> in_contact{plan.in_contact[0] != 0, plan.in_contact[1] != 0};
  if (!state_valid_ || plan.status == support_plan_t::STATUS_INVALID_STATE) {
    return task_torque_t::STATUS_INVALID_STATE;
  }
  in_contact_ = in_contact;
  if (!whole_body_->Update(state_, in_contact)) return task_torque_t::STATUS_SINGULAR;
  if (!started_) {
    started_ = true;
    posture_reference_ = state_.joint_position;
  }
  Eigen::Vector3d orientation_error = Eigen::Vector3d::Zero();
  if (plan.gravity_compensation != 0) {
    balance::GravityCompensation(whole_body_->contact(), torque_);
    posture_reference_ = state_.joint_position;
  } else {
    ReadReferences();
    if (!ComputeTorque(in_contact)) return task_torque_t::STATUS_SINGULAR;
    orientation_error = tasks_->body_orientation_error();
  }
  if (!torque_.allFinite()) return task_torque_t::STATUS_SINGULAR;
  std::copy_n(torque_.data(), torque_.size(), task_torque_->torque.begin());
  SetVector3(orientation_error, task_torque_->body_orientation_error);
  return task_torque_t::STATUS_OK;
}

void TaskController::ReadReferences() {
  const support_plan_t& plan = *support_plan_;
  references_.com = GetMotion(plan.com_reference);
  references_.body = GetMotion(plan.body_reference);
  for (size_t i = 0; i < 2; ++i) {
    references_.foot[i] = GetMotion(plan.foot_reference[i]);
    references_.foot_rotation[i] = GetMotion(plan.foot_rotation_reference[i]);
  }
}

bool TaskController::ComputeTorque(const std::array<bool, 2>& in_contact) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  tasks_->Update(*model_, whole_body_->data(), references_, in_contact);
  if (!task_dynamics_->Compute(contact, tasks_->jacobian(), tasks_->bias_acceleration())) {
    return false;
  }
  task_dynamics_->TaskTorque(tasks_->acceleration(), torque_);
  if (kDeterminedRows < model_->num_velocities()) {
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

ComponentType TaskControllerType() {
  return {"task_controller",
          "the task torque (24) that follows the support plan",
          [] { return std::make_unique<TaskController>(); },
          {},
          {Reads<robot_state_t>("robot_state"), Reads<support_plan_t>("support_plan"),
           Writes<task_torque_t>("task_torque")},
          TaskControllerConfig::descriptor(),
          task_controller_proto_schema};
}

}  // namespace poise
