// The task controller: the task torque (24) that follows the support plan.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "components/balance/joint_limits.h"
#include "components/balance/whole_body.h"
#include "components/framework/component_type.h"
#include "components/framework/operator_acts.h"
#include "components/robot/robot_model.h"
#include "components/task_controller/posture_reference.h"
#include "components/task_controller/soft_ground.h"
#include "components/task_controller/task_list.h"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "poise/task_torque_t.hpp"

namespace poise {

/// ROBOT_STATE, SUPPORT_PLAN -> TASK_TORQUE. When state or plan are invalid or the dynamics are
/// singular the message of the last good tick is sent again with the status set: its torque is what
/// held the robot a moment ago, and no better one is known.
class TaskController : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  void AddSettings(double tick_period);
  void TakeActs(const Tick& tick);
  /// Gives the tasks their gains, less what the ground takes off the COM's.
  void SetGains();
  void Prepare();
  /// Fills the torque; STATUS_* of the message.
  int8_t Control();
  /// Lowers the COM's gains where a foot stands on something soft.
  void FollowGround();
  bool ComputeTorque(const balance::TaskState& state, const FeetInContact& in_contact);
  /// Filters the base's velocity for the tasks.
  void SmoothBase(const support_plan_t& plan);
  /// PD to the posture, within the joints' limits; all joints.
  void ComputePosture();
  bool ComputeTasks(const balance::TaskState& state, const FeetInContact& in_contact,
                    std::span<const TaskList::ForcedJoint> forced);
  /// Joints of the legs that the last torque would drive beyond a limit, with the acceleration that
  /// does not; added to `forced_`. False when there is none.
  bool FindLimits();
  /// Whether the joint is of a leg whose foot is a contact.
  bool Stands(int joint) const;
  /// Whether what moves the joint is a sole that turns on what it is held to stand on.
  bool SoleTurns(int joint) const;

  Input<robot_state_t> robot_state_;
  Input<support_plan_t> support_plan_;
  ActInput operator_;
  Output<task_torque_t> task_torque_;

  std::shared_ptr<const robot::RobotModel> model_;
  std::shared_ptr<balance::WholeBody> whole_body_;
  std::optional<TaskList> tasks_;
  robot::RobotState state_;
  balance::Vector6d base_velocity_ = balance::Vector6d::Zero();  // filtered
  double step_delay_ = 0;  // s by which joint velocities are late in a step
  double base_share_ = 1;  // what of a new velocity it takes over in a tick
  bool state_valid_ = false;
  FeetInContact in_contact_{true, true};  // of the last tick
  bool started_ = false;
  bool others_held_ = false;               // the joints that are no leg's have their posture alone
  balance::StandingGains gains_;           // before what the ground takes off them
  std::optional<SoftGround> soft_ground_;  // none: the COM's gains are given
  balance::TaskGains com_gains_;           // as the tasks have them
  std::optional<PostureReference> posture_;
  std::optional<balance::JointLimits> limits_;  // none: they do not enter the control
  std::array<TaskList::ForcedJoint, TaskList::kMostForced> forced_;
  size_t num_forced_ = 0;
  std::vector<robot::FootArray<bool>> carries_;  // by joint
  Eigen::VectorXd acceleration_;                 // n×1
  Eigen::VectorXd posture_acceleration_, posture_torque_;
  Eigen::VectorXd torque_, free_torque_;
};

ComponentType TaskControllerType();

}  // namespace poise
