#include "components/framework/component_main.h"
#include "sim_ode/sim_ode.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "sim_ode",
                              [] { return std::make_unique<poise::SimOde>(); });
}
