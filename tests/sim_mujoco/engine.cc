#include "tests/sim/engine.h"

#include "sim_mujoco/mujoco_world.h"
#include "sim_mujoco/sim_mujoco_type.h"

namespace poise {

WorldFactory EngineWorlds() { return MujocoWorlds(MujocoConfig()); }
ComponentType EngineType() { return SimMujocoType(); }

}  // namespace poise
