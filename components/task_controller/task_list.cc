#include "components/task_controller/task_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "components/framework/configuration/configuration.h"
#include "components/messages/motion.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"

namespace poise {
namespace {

using robot::Foot;

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

TaskConfig::Reference FootReference(Foot foot) {
  return foot == Foot::kRight ? TaskConfig::RIGHT_FOOT : TaskConfig::LEFT_FOOT;
}

/// What the plan has for a task, where it has anything.
TaskConfig::Reference DefaultReference(const TaskConfig& task) {
  if (task.has_foot()) return FootReference(robot::FootAt(task.foot()));
  if (task.type() == "com") return TaskConfig::COM;
  if (task.type() == "orientation" && !task.has_link()) return TaskConfig::BODY;
  return TaskConfig::START;
}

/// Returns the gains of what moves.
balance::TaskGains GainsOf(const balance::TargetParts& needed, TaskConfig::Reference reference,
                           const std::string& type, const balance::StandingGains& gains) {
  if (needed.angular_momentum) return {0, gains.orientation.kd};
  if (needed.joints) return gains.posture;
  if (type == "com") return gains.com;
  if (reference == TaskConfig::BODY || type == "orientation") return gains.orientation;
  return gains.foot;
}

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

/// Row of the height in a task of a position; −1: it has none.
int HeightRow(const balance::AxisSelection& axes) {
  if (std::ranges::none_of(axes, [](bool selected) { return selected; })) return balance::kZ;
  return axes[balance::kZ] ? axes[balance::kX] + axes[balance::kY] : -1;
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
  const auto check = [&](bool has, const char* name) {
    if (has) return;
    throw ConfigError(fmt::format("{}.{}", field, name),
                      fmt::format("is not set, but {0} is: set all of its gains, or none, which "
                                  "then follow from the robot",
                                  field));
  };
  if (has_position) {
    check(gains.has_kp(), "kp");
  } else if (gains.has_kp()) {
    throw ConfigError(field + ".kp", "must be left out; this task has no position");
  }
  check(gains.has_kd(), "kd");
  return {gains.kp(), gains.kd()};
}

balance::StandingGains ReadStandingGains(const TaskControllerConfig& config,
                                         const balance::StandingGains& rule) {
  balance::StandingGains gains = rule;
  if (config.has_com()) gains.com = ReadGains(config.com(), "com");
  if (config.has_orientation()) gains.orientation = ReadGains(config.orientation(), "orientation");
  if (config.has_foot()) gains.foot = ReadGains(config.foot(), "foot");
  if (config.has_posture()) gains.posture = ReadGains(config.posture(), "posture");
  if (config.has_base_velocity_cutoff()) {
    gains.base_velocity_cutoff = config.base_velocity_cutoff();
  } else if (config.has_com()) {
    gains.base_velocity_cutoff = 0;
  }
  return gains;
}

TaskList::TaskList(const TaskControllerConfig& config,
                   std::shared_ptr<const robot::RobotModel> model,
                   const balance::StandingGains& gains)
    : model_(std::move(model)) {
  if (config.task_size() == 0) {
    for (const TaskConfig& task : PaperTasks()) Add(task, "task", gains);
  }
  for (int i = 0; i < config.task_size(); ++i) {
    Add(config.task(i), fmt::format("task[{}]", i), gains);
  }
  std::ranges::stable_sort(entries_, {}, &Entry::level);
  int rows = kMostForced;
  for (const Entry& entry : entries_) rows += entry.task->num_rows();
  // Forced joints come before the entries' levels, and a COM's height after them.
  const size_t levels = entries_.size() + 2;
  hierarchy_.emplace(model_->num_joints(), rows, static_cast<int>(levels));
  level_rows_.reserve(levels);
  const robot::RobotData stance = robot::Evaluate(*model_, model_->stance().joint_position);
  for (const Foot foot : robot::kFeet) knee_[foot] = robot::Knee(*model_, stance, foot);
  jacobian_.setZero(rows, model_->num_velocities());
  bias_acceleration_.setZero(rows);
  acceleration_.setZero(rows);
}

void TaskList::Add(const TaskConfig& task, const std::string& field,
                   const balance::StandingGains& gains) {
  balance::TaskSpec spec;
  spec.type = task.type();
  spec.link = task.link();
  if (task.has_foot()) spec.foot = robot::FootAt(task.foot());
  spec.point = {task.point().x(), task.point().y(), task.point().z()};
  spec.joints.assign(task.joint().begin(), task.joint().end());
  for (const int axis : task.axis()) spec.axes[static_cast<size_t>(axis)] = true;

  Entry entry;
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
  const bool has_position = needed.position || needed.rotation || needed.joints;
  entry.task->set_gains(task.has_gains() ? ReadGains(task.gains(), field + ".gains", has_position)
                                         : GainsOf(needed, entry.reference, task.type(), gains));
  entry.type = task.type();
  entry.own_gains = task.has_gains();
  entry.foot = spec.foot;
  entry.height_row = needed.position ? HeightRow(spec.axes) : -1;
  for (const Foot foot : robot::kFeet) {
    entry.rests[foot] = spec.foot == foot || entry.reference == FootReference(foot);
  }
  entry.held.joint_position = Eigen::VectorXd::Zero(model_->num_joints());
  entries_.push_back(std::move(entry));
}

void TaskList::SetGains(const balance::StandingGains& gains) {
  for (Entry& entry : entries_) {
    if (entry.own_gains) continue;
    entry.task->set_gains(GainsOf(entry.task->needs(), entry.reference, entry.type, gains));
  }
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
  com_.accelerates_only = plan.com_follows == support_plan_t::FOLLOWS_COP;
  SetRotation(GetMotion(plan.body_reference), &body_);
  for (const Foot f : robot::kFeet) {
    SetPoint(GetMotion(plan.foot_reference[Index(f)]), &foot_[f]);
    SetRotation(GetMotion(plan.foot_rotation_reference[Index(f)]), &foot_[f]);
  }
}

const balance::TaskTarget& TaskList::Target(const Entry& entry) const {
  switch (entry.reference) {
    case TaskConfig::COM:
      return com_;
    case TaskConfig::BODY:
      return body_;
    case TaskConfig::RIGHT_FOOT:
      return foot_[Foot::kRight];
    case TaskConfig::LEFT_FOOT:
      return foot_[Foot::kLeft];
    case TaskConfig::START:
      break;
  }
  return entry.held;
}

bool TaskList::Compute(const balance::TaskState& state, const balance::ContactDynamics& contact,
                       const FeetInContact& in_contact, const Eigen::VectorXd* others,
                       std::span<const ForcedJoint> forced) {
  level_rows_.clear();
  forced = forced.first(std::min<size_t>(forced.size(), kMostForced));
  if (in_contact != written_for_ || forced.size() != num_forced_ || !forced.empty()) {
    jacobian_.setZero();
    written_for_ = in_contact;
    num_forced_ = forced.size();
  }
  Eigen::Index row = 0;
  for (const ForcedJoint& joint : forced) {
    jacobian_(row, 6 + joint.joint) = 1;
    bias_acceleration_[row] = 0;
    acceleration_[row] = joint.acceleration;
    ++row;
  }
  if (row > 0) level_rows_.push_back(static_cast<int>(row));
  const bool leg_stops = std::ranges::any_of(
      robot::kFeet, [&](Foot f) { return in_contact[f] && KneeStops(f, forced); });
  FeetInContact raised{false, false};  // whose height has come before all levels
  Eigen::Index com_height = -1;
  const Entry* last = nullptr;
  for (const Entry& entry : entries_) {
    if (!IsActive(entry, in_contact)) continue;
    const Eigen::Index t = entry.task->num_rows();
    balance::TaskRows rows{jacobian_.middleRows(row, t), bias_acceleration_.segment(row, t),
                           acceleration_.segment(row, t)};
    entry.task->Write(state, Target(entry), &rows);
    // −k_d J v becomes −k_d J of the slower velocity.
    if (!base_lag_.isZero(0)) {
      rows.acceleration.noalias() +=
          entry.task->gains().kd * rows.jacobian.leftCols<6>().lazyProduct(base_lag_);
    }
    if (last == nullptr || entry.level != last->level) level_rows_.push_back(0);
    level_rows_.back() += static_cast<int>(t);
    last = &entry;
    row += t;
    if (entry.height_row < 0) continue;
    const Eigen::Index height = row - t + entry.height_row;
    if (entry.type == "com" && leg_stops && com_height < 0) {
      com_height = height;
      --level_rows_.back();
    } else if (entry.foot && !raised[*entry.foot] && KneeStops(*entry.foot, forced)) {
      raised[*entry.foot] = true;
      MoveRow(height, level_rows_.front());
      if (com_height >= 0) ++com_height;
      ++level_rows_.front();
      --level_rows_.back();
    }
  }
  if (com_height >= 0) {
    MoveRow(com_height, row - 1);
    level_rows_.push_back(1);
  }
  std::erase(level_rows_, 0);
  return hierarchy_->Compute(contact, jacobian_.topRows(row), bias_acceleration_.head(row),
                             acceleration_.head(row), level_rows_, others);
}

void TaskList::MoveRow(Eigen::Index from, Eigen::Index to) {
  const Eigen::Index step = from < to ? 1 : -1;
  for (Eigen::Index i = from; i != to; i += step) {
    jacobian_.row(i).swap(jacobian_.row(i + step));
    std::swap(bias_acceleration_[i], bias_acceleration_[i + step]);
    std::swap(acceleration_[i], acceleration_[i + step]);
  }
}

void TaskList::Archive(StateArchive* archive) {
  for (Entry& entry : entries_) {
    if (entry.reference != TaskConfig::START) continue;
    balance::TaskTarget& held = entry.held;
    archive->Show(held.position, held.rotation, held.joint_position, held.angular_momentum);
  }
}

}  // namespace poise
