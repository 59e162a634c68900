// All components that this program knows: its own, then those of modules.
#pragma once

#include <string>
#include <vector>

#include "components/framework/component_registry.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// By type, each with its summary. The first call makes added components' configurations fields of
/// Scenario: it comes after LoadModules and before a scenario is read. Throws ConfigError where a
/// name is taken.
const ComponentRegistry& Components();

/// The engines that a robot can be simulated in, "mujoco" and "ode", by name.
std::vector<std::string> EngineNames();
/// The engine of the graph's simulated robot; empty: it simulates none.
std::string EngineOf(const Graph& graph);

}  // namespace poise
