#include <memory>

#include "components/framework/component_main.h"
#include "hw_bridge/hw_bridge.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "hw_bridge",
                              [] { return std::make_unique<poise::HwBridge>(); });
}
