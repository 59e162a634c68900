#include "components/task_controller/task_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "components/framework/configuration/configuration.h"
#include "components/messages/motion.h"

namespace poise {
namespace {

/// The paper's list.
std::vector<TaskConfig> PaperTasks() {
  std::vector<TaskConfig> tasks(4);
  tasks[0].set_type("com");
  tasks[1].set_type("orientation");
  tasks[2].set_type("frame");
  tasks[2].set_foot(TaskConfig::RIGHT);
  tasks[3].set_type("frame");
  tasks[3].set_foot(TaskConfig::LEFT);
  return tasks;
}

TaskConfig::Reference FootReference(TaskConfig::Foot foot) {
  return foot == TaskConfig::RIGHT ? TaskConfig::RIGHT_FOOT : TaskConfig::LEFT_FOOT;
}

/// What the plan has for a task, where it has anything.
TaskConfig::Reference DefaultReference(const TaskConfig& task) {
  if (task.has_foot()) return FootReference(task.foot());
  if (task.type() == "com") return TaskConfig::COM;
  if (task.type() == "orientation" && !task.has_link()) return TaskConfig::BODY;
  return TaskConfig::START;
}

struct NamedGains {
  std::string field;
  const Gains* gains;
};

/// The task's own gains, or those of the reference that it follows.
NamedGains GainsOf(const TaskConfig& task, TaskConfig::Reference reference,
                   const std::string& field, const TaskControllerConfig& config) {
  if (task.has_gains()) return {field + ".gains", &task.gains()};
  switch (reference) {
    case TaskConfig::COM:
      if (config.has_com()) return {"com", &config.com()};
      throw ConfigError("com", "is missing; give kp and kd of the COM's position");
    case TaskConfig::BODY:
      if (config.has_orientation()) return {"orientation", &config.orientation()};
      throw ConfigError("orientation", "is missing; give kp and kd of the body's orientation");
    case TaskConfig::RIGHT_FOOT:
    case TaskConfig::LEFT_FOOT:
      if (config.has_foot()) return {"foot", &config.foot()};
      throw ConfigError("foot", "is missing; give kp and kd of the pose of a foot out of contact");
    case TaskConfig::START:
      break;
  }
  throw ConfigError(field + ".gains",
                    fmt::format("is missing; give kp and kd of task '{}'", task.type()));
}

/// Parts of a target that a reference of the plan has.
balance::TargetParts PartsOf(TaskConfig::Reference reference) {
  switch (reference) {
    case TaskConfig::COM:
      return {.position = true};
    case TaskConfig::BODY:
      return {.rotation = true};
    case TaskConfig::RIGHT_FOOT:
    case TaskConfig::LEFT_FOOT:
      return {.position = true, .rotation = true};
    case TaskConfig::START:
      break;
  }
  return {.position = true, .rotation = true, .joints = true, .angular_momentum = true};
}

void CheckReference(const balance::TargetParts& needed, const TaskConfig& task,
                    TaskConfig::Reference reference, const std::string& field) {
  const balance::TargetParts has = PartsOf(reference);
  const char* missing = needed.position && !has.position                   ? "position"
                        : needed.rotation && !has.rotation                 ? "rotation"
                        : needed.joints && !has.joints                     ? "joint positions"
                        : needed.angular_momentum && !has.angular_momentum ? "angular momentum"
                                                                           : nullptr;
  if (missing == nullptr) return;
  throw ConfigError(field + ".reference",
                    fmt::format("is {}, of which the plan has no {}, and task '{}' needs it",
                                TaskConfig::Reference_Name(reference), missing, task.type()));
}

void SetPoint(const PointMotion& motion, balance::TaskTarget* target) {
  target->position = motion.position;
  target->velocity = motion.velocity;
  target->acceleration = motion.acceleration;
}

void SetRotation(const RotationMotion& motion, balance::TaskTarget* target) {
  target->rotation = motion.rotation;
  target->angular_velocity = motion.angular_velocity;
  target->angular_acceleration = motion.angular_acceleration;
}

}  // namespace

balance::TaskGains ReadGains(const Gains& gains, const std::string& field, bool has_position) {
  const auto check = [&](bool has, double value, const char* name) {
    if (!has || !(value > 0) || !std::isfinite(value)) {
      throw ConfigError(fmt::format("{}.{}", field, name), "must be a positive number");
    }
  };
  if (has_position) {
    check(gains.has_kp(), gains.kp(), "kp");
  } else if (gains.has_kp()) {
    throw ConfigError(field + ".kp", "must be left out; this task has no position");
  }
  check(gains.has_kd(), gains.kd(), "kd");
  return {gains.kp(), gains.kd()};
}

TaskList::TaskList(const TaskControllerConfig& config,
                   std::shared_ptr<const robot::RobotModel> model)
    : model_(std::move(model)) {
  if (config.task_size() == 0) {
    for (const TaskConfig& task : PaperTasks()) Add(task, "task", config);
  }
  for (int i = 0; i < config.task_size(); ++i) {
    Add(config.task(i), fmt::format("task[{}]", i), config);
  }
  std::ranges::stable_sort(entries_, {}, &Entry::level);
  int rows = 0;
  for (const Entry& entry : entries_) rows += entry.task->num_rows();
  hierarchy_.emplace(model_->num_joints(), rows, static_cast<int>(entries_.size()));
  level_rows_.reserve(entries_.size());
  jacobian_.setZero(rows, model_->num_velocities());
  bias_acceleration_.setZero(rows);
  acceleration_.setZero(rows);
}

void TaskList::Add(const TaskConfig& task, const std::string& field,
                   const TaskControllerConfig& config) {
  balance::TaskSpec spec;
  spec.type = task.type();
  spec.link = task.link();
  spec.foot = task.has_foot() ? static_cast<int>(task.foot()) : -1;
  spec.point = {task.point().x(), task.point().y(), task.point().z()};
  spec.joints.assign(task.joint().begin(), task.joint().end());
  for (const int axis : task.axis()) spec.axes[static_cast<size_t>(axis)] = true;

  Entry entry;
  if (task.level() < 0) throw ConfigError(field + ".level", "must be 0 or more");
  entry.level = task.level();
  entry.reference = task.has_reference() ? task.reference() : DefaultReference(task);
  try {
    entry.task = balance::CreateTask(spec, *model_);
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    const size_t colon = what.find(": ");
    if (colon == std::string::npos) throw ConfigError(field, what);
    throw ConfigError(field + "." + what.substr(0, colon), what.substr(colon + 2));
  }
  const balance::TargetParts needed = entry.task->needs();
  CheckReference(needed, task, entry.reference, field);
  const NamedGains gains = GainsOf(task, entry.reference, field, config);
  entry.task->set_gains(
      ReadGains(*gains.gains, gains.field, needed.position || needed.rotation || needed.joints));
  for (const int foot : {0, 1}) {
    const auto own = static_cast<TaskConfig::Foot>(foot);
    entry.rests[static_cast<size_t>(foot)] =
        (task.has_foot() && task.foot() == own) || entry.reference == FootReference(own);
  }
  entry.held.joint_position = Eigen::VectorXd::Zero(model_->num_joints());
  entries_.push_back(std::move(entry));
}

TaskList::Rows TaskList::CountRows(const FeetInContact& in_contact) const {
  Rows rows;
  const Entry* first = nullptr;
  for (const Entry& entry : entries_) {
    if (!IsActive(entry, in_contact)) continue;
    if (first == nullptr) first = &entry;
    if (entry.level == first->level) rows.first += entry.task->num_rows();
    rows.all += entry.task->num_rows();
  }
  return rows;
}

void TaskList::Hold(const balance::TaskState& state) {
  for (Entry& entry : entries_) {
    if (entry.reference == TaskConfig::START) entry.task->Hold(state, &entry.held);
  }
}

void TaskList::Follow(const support_plan_t& plan) {
  SetPoint(GetMotion(plan.com_reference), &com_);
  SetRotation(GetMotion(plan.body_reference), &body_);
  for (size_t i = 0; i < 2; ++i) {
    SetPoint(GetMotion(plan.foot_reference[i]), &foot_[i]);
    SetRotation(GetMotion(plan.foot_rotation_reference[i]), &foot_[i]);
  }
}

const balance::TaskTarget& TaskList::Target(const Entry& entry) const {
  switch (entry.reference) {
    case TaskConfig::COM:
      return com_;
    case TaskConfig::BODY:
      return body_;
    case TaskConfig::RIGHT_FOOT:
      return foot_[0];
    case TaskConfig::LEFT_FOOT:
      return foot_[1];
    case TaskConfig::START:
      break;
  }
  return entry.held;
}

bool TaskList::Compute(const balance::TaskState& state, const balance::ContactDynamics& contact,
                       const FeetInContact& in_contact) {
  level_rows_.clear();
  if (in_contact != written_for_) {
    jacobian_.setZero();
    written_for_ = in_contact;
  }
  Eigen::Index row = 0;
  const Entry* last = nullptr;
  for (const Entry& entry : entries_) {
    if (!IsActive(entry, in_contact)) continue;
    const Eigen::Index t = entry.task->num_rows();
    balance::TaskRows rows{jacobian_.middleRows(row, t), bias_acceleration_.segment(row, t),
                           acceleration_.segment(row, t)};
    entry.task->Write(state, Target(entry), &rows);
    if (last == nullptr || entry.level != last->level) level_rows_.push_back(0);
    level_rows_.back() += static_cast<int>(t);
    last = &entry;
    row += t;
  }
  return hierarchy_->Compute(contact, jacobian_.topRows(row), bias_acceleration_.head(row),
                             acceleration_.head(row), level_rows_);
}

void TaskList::Archive(StateArchive* archive) {
  for (Entry& entry : entries_) {
    if (entry.reference != TaskConfig::START) continue;
    balance::TaskTarget& held = entry.held;
    archive->Show(held.position, held.rotation, held.joint_position, held.angular_momentum);
  }
}

}  // namespace poise
