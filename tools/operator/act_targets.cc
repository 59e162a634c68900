#include "tools/operator/act_targets.h"

#include <algorithm>

#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "tools/scenario/registry.h"

namespace poise {

robot::RobotModel RobotOf(const RunSpec& spec) {
  std::string robot, urdf;
  for (const Resource& resource : spec.resource()) {
    if (resource.name() == "robot") robot = resource.text();
    if (resource.name() == "urdf") urdf = resource.text();
  }
  return robot::LoadRobotTexts(robot, urdf);
}

std::string ActChannel(const Graph& graph, int component) {
  for (const Connection& input : graph.component(component).input()) {
    for (const Channel& channel : graph.channel()) {
      if (channel.name() == input.channel() && channel.type() == kActType) return channel.name();
    }
  }
  return {};
}

ActTargets FindActTargets(const RunSpec& spec) {
  const Graph& graph = spec.graph();
  ActTargets targets;
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentType* const type = Components().TypeNamed(TypeOf(graph.component(i)));
    if (type == nullptr || ActChannel(graph, i).empty()) continue;
    if (!type->traits.engine.empty()) targets.simulator = i;
    const auto plans = [](const PortType& port) {
      return !port.input && port.type == "support_plan_t";
    };
    if (std::ranges::any_of(type->ports, plans)) targets.planner = i;
  }
  const robot::RobotModel model = RobotOf(spec);
  targets.weight = model.total_mass() * robot::kGravity;
  for (const auto& body : model.bodies()) targets.bodies.push_back(body.name);
  for (const auto& foot : model.feet()) targets.feet.push_back(foot.name);
  return targets;
}

}  // namespace poise
