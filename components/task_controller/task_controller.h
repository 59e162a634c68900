// The task controller: scenario phases, references and the task torque (24).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "components/balance/task_dynamics.h"
#include "components/balance/whole_body.h"
#include "components/framework/component.h"
#include "components/robot/robot_model.h"
#include "components/task_controller/hip_strategy.h"
#include "components/task_controller/landing.h"
#include "components/task_controller/phase_schedule.h"
#include "components/task_controller/reference_generator.h"
#include "components/task_controller/task_stack.h"
#include "poise/robot_state_t.hpp"
#include "poise/task_torque_t.hpp"

namespace poise {

/// ROBOT_STATE -> TASK_TORQUE. When a state is invalid or its dynamics are singular the message of
/// the last good tick is sent again with the status set: its torque is what held the robot a moment
/// ago, and no better one is known.
class TaskController : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  void Step(const Tick& tick);
  /// Fills contacts, phase, references and torque; STATUS_* of the message.
  int8_t Control(double time);
  /// Contacts, references and landings of a phase's first tick; false: dynamics are singular.
  bool BeginPhase(double time);
  /// The scenario's references where the free foot follows them, else its landing's.
  void UpdateReferences(double time);
  /// Turns the body's reference by the hip strategy's tilt.
  void TiltBody(double time);
  /// A joint of a stance leg that would come too near to its limit before it could be braked.
  bool NearJointLimit() const;
  EstimatedPose Estimate() const;
  /// By foot: it alone can carry the robot, as the capture point, where the COM can be brought to
  /// rest, lies inside its reduced rectangle. At rest that is the COM's projection, and the CoP.
  std::array<bool, 2> ComOverFoot() const;
  bool ComputeTorque(const References& references, const std::array<bool, 2>& in_contact);
  void Report(const References& references, const std::array<bool, 2>& in_contact);
  int8_t WaitingCode() const;

  Input<robot_state_t> robot_state_;
  Output<task_torque_t> task_torque_;

  std::shared_ptr<const robot::RobotModel> model_;
  std::shared_ptr<balance::WholeBody> whole_body_;
  std::optional<PhaseSchedule> schedule_;
  std::optional<TaskStack> tasks_;
  std::optional<balance::TaskDynamics> task_dynamics_;
  std::optional<ReferenceGenerator> generator_;
  std::optional<HipStrategy> hip_strategy_;
  double joint_reserve_ = 0, brake_time_ = 0;  // rad, s, of the hip strategy
  std::vector<Landing> landing_;               // by foot
  References references_;
  robot::RobotState state_;
  std::array<bool, 2> in_contact_{true, true};
  bool started_ = false;
  bool last_controlled_ = false;  // the phase before had tasks
  PdGains posture_;
  std::array<Eigen::Vector2d, 2> stance_half_;  // m, of each sole's reduced rectangle
  Eigen::VectorXd posture_reference_, posture_acceleration_, posture_torque_;
  Eigen::VectorXd torque_;
};

}  // namespace poise
