#include "components/framework/runners/component_main.h"
#include "hw_bridge/unitree_emulator/unitree_emulator_type.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::UnitreeEmulatorType());
}
