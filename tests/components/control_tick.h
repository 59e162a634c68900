// The controller's components in one process over a swaying motion: estimator, planner, task
// controller, monitor, redistributor.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "components/balance/whole_body.h"
#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/redistributor/redistributor.h"
#include "components/state_estimator/state_estimator.h"
#include "components/step_planner/step_planner.h"
#include "components/task_controller/task_controller.h"
#include "poise/robot_sensors_t.hpp"
#include "tests/components/control_fixture.h"

namespace poise {

/// Sensor readings of a robot that sways on its feet (double support) or on the right foot with the
/// left one moving: every tick another state. The feet in contact stand still and level. On one
/// foot the COM goes as far above it as the robot reaches.
std::vector<robot_sensors_t> SwayingSensors(const robot::RobotModel& model,
                                            const Contacts& in_contact, int num_ticks);

/// The five components as the inline runner calls them, with one WholeBody between them.
class ControlTick {
 public:
  ControlTick(robot::TestRobot robot, const Contacts& in_contact)
      : ControlTick(robot::RobotPath(robot), in_contact) {}
  /// `robot_path`: a Robot file. `redistributor`: RedistributorConfig beyond the paper's limits.
  ControlTick(const std::string& robot_path, const Contacts& in_contact,
              const std::string& redistributor = "");

  void Estimate(const robot_sensors_t& sensors, const Tick& tick);
  void Plan(const Tick& tick) { planner_.Run(tick); }
  void Task(const Tick& tick) { task_.Run(tick); }
  void Monitor(const Tick& tick) { monitor_.Run(tick); }
  void Redistribute(const Tick& tick) { redistributor_.Run(tick); }
  void Run(const robot_sensors_t& sensors, const Tick& tick) {
    Estimate(sensors, tick);
    Plan(tick);
    Task(tick);
    Monitor(tick);
    Redistribute(tick);
  }

  const robot_state_t& state() const { return estimator_.output<robot_state_t>(); }
  const support_plan_t& plan() const { return planner_.output<support_plan_t>(); }
  const task_torque_t& task() const { return task_.output<task_torque_t>(); }
  const balance_torque_t& balance() const { return monitor_.output<balance_torque_t>(); }
  const joint_command_t& command() const { return redistributor_.output<joint_command_t>(); }
  balance::WholeBody* whole_body() { return whole_body_.get(); }
  const robot::RobotModel& model() const { return whole_body_->model(); }

 private:
  ControlContext context_;
  Harness<StateEstimator> estimator_;
  Harness<StepPlanner> planner_;
  Harness<TaskController> task_;
  Harness<ContactWrenchMonitor> monitor_;
  Harness<Redistributor> redistributor_;
  std::shared_ptr<balance::WholeBody> whole_body_;
};

}  // namespace poise
