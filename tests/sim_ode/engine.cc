#include "tests/sim/engine.h"

#include "sim_ode/ode_world.h"
#include "sim_ode/sim_ode_type.h"

// A step that ODE gives up in the middle of leaves 80 bytes of its job list behind; the run ends
// with it.
extern "C" const char* __lsan_default_suppressions() { return "leak:PreallocateJobInfos"; }

namespace poise {

WorldFactory EngineWorlds() { return OdeWorlds(OdeConfig()); }
ComponentType EngineType() { return SimOdeType(); }

}  // namespace poise
