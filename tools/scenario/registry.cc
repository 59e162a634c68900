#include "tools/scenario/registry.h"

#include <set>

#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/framework/configuration/added_fields.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/redistributor/redistributor.h"
#include "components/state_estimator/state_estimator.h"
#include "components/step_planner/step_planner.h"
#include "components/task_controller/task_controller.h"
#include "hw_bridge/drive_emulator/drive_emulator.h"
#include "hw_bridge/hw_bridge.h"
#include "hw_bridge/unitree_emulator/unitree_emulator.h"
#include "sim_mujoco/sim_mujoco_type.h"
#include "sim_ode/sim_ode_type.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

const ComponentRegistry& Components() {
  static const ComponentRegistry registry = [] {
    ComponentRegistry r;
    for (const ComponentType& type :
         {SimOdeType(), SimMujocoType(), HwBridgeType(), DriveEmulatorType(), UnitreeEmulatorType(),
          StateEstimatorType(), StepPlannerType(), TaskControllerType(), ContactWrenchMonitorType(),
          RedistributorType()}) {
      r.Add(type);
    }
    // A scenario holds the configuration of a component that it does not know, too.
    for (const ComponentType& type : AddedComponents()) {
      r.Add(type);
      if (type.config != nullptr) AddField(*Scenario::descriptor(), type.name, *type.config);
    }
    return r;
  }();
  return registry;
}

std::vector<std::string> EngineNames() {
  std::set<std::string> engines;
  for (const auto& [type, entry] : Components().entries()) engines.insert(entry.traits.engine);
  engines.erase("");
  return {engines.begin(), engines.end()};
}

std::string EngineOf(const Graph& graph) {
  std::string engine;
  for (const ComponentInstance& instance : graph.component()) {
    const std::string& of = Components().TraitsOf(TypeOf(instance)).engine;
    if (!of.empty()) engine = of;
  }
  return engine;
}

}  // namespace poise
