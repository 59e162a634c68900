// The controller's tasks as its configuration lists them: types, levels, and what each one follows.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/balance/task_hierarchy.h"
#include "components/balance/tasks/task.h"
#include "components/framework/state_archive.h"
#include "components/task_controller/task_controller.pb.h"
#include "poise/support_plan_t.hpp"

namespace poise {

/// Which feet are in contact; right first.
using FeetInContact = std::array<bool, 2>;

/// Gains at `field` of the configuration. Throws ConfigError for what is no positive number, and,
/// without `has_position`, for a kp.
balance::TaskGains ReadGains(const Gains& gains, const std::string& field,
                             bool has_position = true);

/// A configuration without tasks has the paper's three on one level: the COM's position, the
/// body's orientation, the pose of each foot out of contact.
class TaskList {
 public:
  /// Throws ConfigError that names the task's field.
  TaskList(const TaskControllerConfig& config, std::shared_ptr<const robot::RobotModel> model);

  /// Rows of the first level that has any, and of all, with these contacts.
  struct Rows {
    int first = 0, all = 0;
  };
  Rows CountRows(const FeetInContact& in_contact) const;

  /// Tasks that follow no plan hold what they find at this state.
  void Hold(const balance::TaskState& state);
  /// Takes over the references of a plan.
  void Follow(const support_plan_t& plan);
  /// The hierarchy's torque at `state`, for which `contact` was computed. False when no task is
  /// active, or as TaskHierarchy::Compute says. Never allocates.
  bool Compute(const balance::TaskState& state, const balance::ContactDynamics& contact,
               const FeetInContact& in_contact);
  const balance::TaskHierarchy& hierarchy() const { return *hierarchy_; }

  /// The references that are held.
  void Archive(StateArchive* archive);

 private:
  struct Entry {
    std::unique_ptr<balance::Task> task;
    int level = 0;
    TaskConfig::Reference reference = TaskConfig::START;
    std::array<bool, 2> rests{false, false};  // while this foot is in contact
    balance::TaskTarget held;
  };

  void Add(const TaskConfig& task, const std::string& field, const TaskControllerConfig& config);
  const balance::TaskTarget& Target(const Entry& entry) const;
  static bool IsActive(const Entry& entry, const FeetInContact& in_contact) {
    return !(entry.rests[0] && in_contact[0]) && !(entry.rests[1] && in_contact[1]);
  }

  std::shared_ptr<const robot::RobotModel> model_;
  std::vector<Entry> entries_;  // by level
  balance::TaskTarget com_, body_;
  std::array<balance::TaskTarget, 2> foot_;
  std::optional<balance::TaskHierarchy> hierarchy_;
  std::vector<int> level_rows_;
  Eigen::MatrixXd jacobian_;
  FeetInContact written_for_{false, false};  // other feet, other rows
  Eigen::VectorXd bias_acceleration_, acceleration_;
};

}  // namespace poise
