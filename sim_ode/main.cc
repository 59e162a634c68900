#include "components/framework/runners/component_main.h"
#include "sim_ode/sim_ode_type.h"

int main(int argc, char** argv) { return poise::ComponentMain(argc, argv, poise::SimOdeType()); }
