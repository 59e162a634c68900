// The controller's tasks as its configuration lists them: types, levels, and what each one follows.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "components/balance/gains/gain_rule.h"
#include "components/balance/task_hierarchy.h"
#include "components/balance/tasks/task.h"
#include "components/framework/state_archive.h"
#include "components/task_controller/task_controller.pb.h"
#include "poise/support_plan_t.hpp"

namespace poise {

using FeetInContact = robot::FootArray<bool>;

/// Gains at `field` of the configuration. Throws ConfigError for what is no positive number, and,
/// without `has_position`, for a kp.
balance::TaskGains ReadGains(const Gains& gains, const std::string& field,
                             bool has_position = true);

/// The gains of the configuration; those that it does not give are those of `rule`. Throws
/// ConfigError.
balance::StandingGains ReadStandingGains(const TaskControllerConfig& config,
                                         const balance::StandingGains& rule);

/// A configuration without tasks has the paper's three on one level: the COM's position, the
/// body's orientation, the pose of each foot out of contact.
class TaskList {
 public:
  /// `gains` are those of tasks without their own. Throws ConfigError that names the task's field.
  TaskList(const TaskControllerConfig& config, std::shared_ptr<const robot::RobotModel> model,
           const balance::StandingGains& gains);

  /// Rows of the first level that has any, and of all, with these contacts.
  struct Rows {
    int first = 0, all = 0;
  };
  Rows CountRows(const FeetInContact& in_contact) const;

  /// Tasks without gains of their own have these from now on.
  void SetGains(const balance::StandingGains& gains);
  /// Tasks that follow no plan hold what they find at this state.
  void Hold(const balance::TaskState& state);
  /// Takes over the references of a plan.
  void Follow(const support_plan_t& plan);
  /// [linear; angular], m/s and rad/s: how much faster the base of the next states moves than the
  /// tasks are to see it.
  void set_base_velocity_lag(const balance::Vector6d& lag) { base_lag_ = lag; }
  /// The hierarchy's torque at `state`, for which `contact` was computed. False when no task is
  /// active, or as TaskHierarchy::Compute says, which gets `others`. `forced` come before all
  /// levels: joints that must accelerate so (rad/s²), at most kMostForced. The knee of a free foot
  /// among them takes nothing of that foot's height, which then comes before all levels, too: a
  /// foot that lands late lands too late. That of a foot in contact takes the COM's height, which
  /// then comes after all levels: a leg that gets no longer cannot hold it up. Never allocates.
  struct ForcedJoint {
    int joint = -1;
    double acceleration = 0;
  };
  static constexpr int kMostForced = 4;
  bool Compute(const balance::TaskState& state, const balance::ContactDynamics& contact,
               const FeetInContact& in_contact, const Eigen::VectorXd* others = nullptr,
               std::span<const ForcedJoint> forced = {});
  const balance::TaskHierarchy& hierarchy() const { return *hierarchy_; }

  /// The references that are held.
  void Archive(StateArchive* archive);

 private:
  struct Entry {
    std::unique_ptr<balance::Task> task;
    int level = 0;
    TaskConfig::Reference reference = TaskConfig::START;
    FeetInContact rests;  // while this foot is in contact
    balance::TaskTarget held;
    std::string type;
    bool own_gains = false;
    std::optional<robot::Foot> foot;  // whose frame it is
    int height_row = -1;              // of its rows; −1: it has none
  };

  void Add(const TaskConfig& task, const std::string& field, const balance::StandingGains& gains);
  const balance::TaskTarget& Target(const Entry& entry) const;
  /// Moves a row to another place; those in between close up.
  void MoveRow(Eigen::Index from, Eigen::Index to);
  bool KneeStops(robot::Foot foot, std::span<const ForcedJoint> forced) const {
    return std::ranges::any_of(forced, [&](const auto& j) { return j.joint == knee_[foot]; });
  }
  static bool IsActive(const Entry& entry, const FeetInContact& in_contact) {
    return std::ranges::none_of(robot::kFeet,
                                [&](robot::Foot f) { return entry.rests[f] && in_contact[f]; });
  }

  std::shared_ptr<const robot::RobotModel> model_;
  std::vector<Entry> entries_;          // by level
  robot::FootArray<int> knee_{-1, -1};  // joints
  balance::TaskTarget com_, body_;
  robot::FootArray<balance::TaskTarget> foot_;
  std::optional<balance::TaskHierarchy> hierarchy_;
  std::vector<int> level_rows_;
  Eigen::MatrixXd jacobian_;
  FeetInContact written_for_{false, false};  // other feet, other rows
  size_t num_forced_ = 0;                    // and other forced joints
  balance::Vector6d base_lag_ = balance::Vector6d::Zero();
  Eigen::VectorXd bias_acceleration_, acceleration_;
};

}  // namespace poise
