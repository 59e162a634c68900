#include <memory>

#include "components/framework/component_main.h"
#include "hw_bridge/drive_emulator/drive_emulator.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "drive_emulator",
                              [] { return std::make_unique<poise::DriveEmulator>(); });
}
