// Planner, task controller, monitor and redistributor together, for the redistributor's tests.
#pragma once

#include <string>

#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/framework/configuration/configuration.h"
#include "components/redistributor/redistributor.h"
#include "components/step_planner/step_planner.h"
#include "components/task_controller/task_controller.h"
#include "tests/components/control_fixture.h"

namespace poise {

/// The four components in one process with what they share, as the inline graph runs them.
class Chain {
 public:
  Chain(robot::TestRobot robot, const std::string& phases, const std::string& monitor,
        const std::string& redistributor)
      : model_(robot::LoadTestRobot(robot)),
        context_(robot),
        planner_(&context_, phases),
        task_(&context_, TaskControllerText()),
        monitor_(&context_, monitor),
        redistributor_(&context_, redistributor) {
    planner_.Bind("robot_state", &state_);
    task_.Bind("robot_state", &state_);
    task_.Bind("support_plan", &plan());
    monitor_.Bind("robot_state", &state_);
    monitor_.Bind("support_plan", &plan());
    monitor_.Bind("task_torque", &task());
    redistributor_.Bind("robot_state", &state_);
    redistributor_.Bind("support_plan", &plan());
    redistributor_.Bind("balance_torque", &balance());
  }
  const joint_command_t& Run(const robot::RobotState& state, int64_t tick) {
    state_ = StateMessage(model_, state);
    return RunMessage(tick);
  }
  const joint_command_t& RunMessage(int64_t tick) {
    planner_.Run(TickAt(tick));
    task_.Run(TickAt(tick));
    monitor_.Run(TickAt(tick));
    redistributor_.Run(TickAt(tick));
    return redistributor_.output<joint_command_t>();
  }
  const robot::RobotModel& model() const { return model_; }
  const support_plan_t& plan() const { return planner_.output<support_plan_t>(); }
  const task_torque_t& task() const { return task_.output<task_torque_t>(); }
  const balance_torque_t& balance() const { return monitor_.output<balance_torque_t>(); }
  robot_state_t& state() { return state_; }

 private:
  robot::RobotModel model_;
  ControlContext context_;
  robot_state_t state_;
  Harness<StepPlanner> planner_;
  Harness<TaskController> task_;
  Harness<ContactWrenchMonitor> monitor_;
  Harness<Redistributor> redistributor_;
};

/// The field that a configuration is refused for; "accepted" when it is not.
inline std::string RefusedField(const std::string& extra) {
  ControlContext context(robot::TestRobot::kDyros);
  try {
    Harness<Redistributor> harness(&context, RedistributorText(extra));
  } catch (const ConfigError& error) {
    return error.field();
  }
  return "accepted";
}

}  // namespace poise
