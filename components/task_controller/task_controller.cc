#include "components/task_controller/task_controller.h"

#include <fmt/format.h>

#include <algorithm>

#include "components/messages/archive_message.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "components/messages/robot_resource.h"
#include "components/task_controller/task_controller.pb.h"
#include "components/task_controller/task_controller_type.h"

namespace poise {

std::string_view task_controller_proto_schema();  // generated
namespace {

/// Throws ConfigError when the tasks cannot be met on these feet, or leave motions to nobody.
void CheckRows(const TaskList& tasks, const robot::RobotModel& model, const FeetInContact& feet,
               const TaskControllerConfig& config) {
  const char* support = feet[0] && feet[1] ? "on both feet"
                        : feet[0]          ? "on the right foot"
                                           : "on the left foot";
  const int motions = model.num_velocities() - 6 * (feet[0] ? 1 : 0) - 6 * (feet[1] ? 1 : 0);
  const TaskList::Rows rows = tasks.CountRows(feet);
  if (rows.first > motions) {
    throw ConfigError("task", fmt::format("asks for {} motions on its first level, and robot '{}' "
                                          "has {} {}: put some on another level",
                                          rows.first, model.name(), motions, support));
  }
  if (rows.all == 0) {
    throw ConfigError("task", fmt::format("has none that does not rest {}: add one", support));
  }
  if (rows.all < motions && !config.has_posture()) {
    throw ConfigError("posture", fmt::format("is missing; the tasks leave {} joint motions of "
                                             "robot '{}' free {}: give kp and kd",
                                             motions - rows.all, model.name(), support));
  }
}

}  // namespace

void TaskController::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<TaskControllerConfig>();
  model_ = LoadRobot(context);
  const int num_joints = model_->num_joints();
  tasks_.emplace(config, model_);
  if (config.has_posture()) posture_ = ReadGains(config.posture(), "posture");
  for (const FeetInContact& feet : {FeetInContact{true, true}, {true, false}, {false, true}}) {
    CheckRows(*tasks_, *model_, feet, config);
  }

  whole_body_ = context.shared->Get<balance::WholeBody>(
      "estimated", [&] { return std::make_shared<balance::WholeBody>(model_); });
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
  const balance::TaskState state{*model_, state_, whole_body_->data()};
  if (!started_ || plan.gravity_compensation != 0) {
    started_ = true;
    posture_reference_ = state_.joint_position;
    tasks_->Hold(state);
  }
  Eigen::Vector3d orientation_error = Eigen::Vector3d::Zero();
  if (plan.gravity_compensation != 0) {
    balance::GravityCompensation(whole_body_->contact(), torque_);
  } else {
    tasks_->Follow(plan);
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

bool TaskController::ComputeTorque(const balance::TaskState& state,
                                   const FeetInContact& in_contact) {
  const balance::ContactDynamics& contact = whole_body_->contact();
  if (!tasks_->Compute(state, contact, in_contact)) return false;
  const balance::TaskHierarchy& hierarchy = tasks_->hierarchy();
  torque_ = hierarchy.torque();
  if (hierarchy.num_free() > 0) {
    // (28): what the tasks leave free is held up against gravity and drawn to the posture of the
    // start, the joints' own inertia as weight.
    posture_acceleration_ = posture_.kp * (posture_reference_ - state_.joint_position) -
                            posture_.kd * state_.joint_velocity;
    balance::GravityCompensation(contact, posture_torque_);
    const Eigen::Index k = posture_torque_.size();
    posture_torque_.noalias() +=
        whole_body_->data().mass_matrix.bottomRightCorner(k, k) * posture_acceleration_;
    hierarchy.ProjectIntoNullSpace(posture_torque_);
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
