// The engine that the tests of the simulated robot are built with: poise_engine_tests links each of
// them to the calling folder's engine.cc, which says what it is.
#pragma once

#include "components/framework/component_type.h"
#include "sim/simulation.h"

namespace poise {

/// The engine's worlds with its default configuration.
WorldFactory EngineWorlds();
/// The engine's process.
ComponentType EngineType();

/// A simulation in that engine.
class EngineSimulation : public Simulation {
 public:
  EngineSimulation(const robot::RobotModel& model, const SimConfig& config, double tick_period,
                   uint64_t seed, int64_t lead_ticks = 0)
      : Simulation(model, config, EngineWorlds(), tick_period, seed, lead_ticks) {}
};

}  // namespace poise
