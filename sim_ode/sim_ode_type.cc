#include "sim_ode/sim_ode_type.h"

#include "sim/sim_component.h"
#include "sim_ode/ode_world.h"
#include "sim_ode/sim_ode.pb.h"

namespace poise {

std::string_view sim_ode_proto_schema();  // generated
namespace {

SimSetup ReadSetup(const ComponentContext& context) {
  const auto config = context.config<SimOdeConfig>();
  try {
    return {config.sim(), OdeWorlds(config.ode())};
  } catch (const ConfigError& error) {
    throw ConfigError("ode." + error.field(), error.problem());
  }
}

}  // namespace

ComponentType SimOdeType() {
  return SimType("ode", "the robot, the ground and the pushes, simulated in ODE", ReadSetup,
                 SimOdeConfig::descriptor(), sim_ode_proto_schema);
}

}  // namespace poise
