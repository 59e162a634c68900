#include "sim_mujoco/sim_mujoco_type.h"

#include "sim/sim_component.h"
#include "sim_mujoco/mujoco_world.h"
#include "sim_mujoco/sim_mujoco.pb.h"

namespace poise {

std::string_view sim_mujoco_proto_schema();  // generated
namespace {

SimSetup ReadSetup(const ComponentContext& context) {
  const auto config = context.config<SimMujocoConfig>();
  try {
    return {config.sim(), MujocoWorlds(config.mujoco())};
  } catch (const ConfigError& error) {
    throw ConfigError("mujoco." + error.field(), error.problem());
  }
}

}  // namespace

ComponentType SimMujocoType() {
  return SimType("mujoco", "the robot, the ground and the pushes, simulated in MuJoCo", ReadSetup,
                 SimMujocoConfig::descriptor(), sim_mujoco_proto_schema);
}

}  // namespace poise
