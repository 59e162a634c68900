#include "components/framework/runners/component_main.h"
#include "sim_mujoco/sim_mujoco_type.h"

int main(int argc, char** argv) { return poise::ComponentMain(argc, argv, poise::SimMujocoType()); }
