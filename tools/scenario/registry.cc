#include "tools/scenario/registry.h"

#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/redistributor/redistributor.h"
#include "components/state_estimator/state_estimator.h"
#include "components/task_controller/task_controller.h"
#include "hw_bridge/drive_emulator/drive_emulator.h"
#include "hw_bridge/hw_bridge.h"
#include "sim_ode/sim_ode.h"

namespace poise {
namespace {

template <class T>
std::unique_ptr<Component> Make() {
  return std::make_unique<T>();
}

}  // namespace

const ComponentRegistry& Components() {
  static const ComponentRegistry registry = [] {
    ComponentRegistry r;
    r.Add("sim_ode", "the robot, the ground and the pushes, simulated in ODE", Make<SimOde>);
    r.Add("hw_bridge", "drives and sensors: units, limits, safety states, e-stop", Make<HwBridge>);
    r.Add("drive_emulator", "EtherCAT drives on the simulated robot's motors, with faults",
          Make<DriveEmulator>);
    r.Add("state_estimator", "floating base and joint velocities from IMU, encoders and feet",
          Make<StateEstimator>);
    r.Add("task_controller", "phases, references and the task torque (24)", Make<TaskController>);
    r.Add("contact_wrench_monitor", "expected wrenches and CoP control in the null space (39)",
          Make<ContactWrenchMonitor>);
    r.Add("redistributor", "ratio eta, contact transitions and the joint torque (53)",
          Make<Redistributor>);
    return r;
  }();
  return registry;
}

}  // namespace poise
