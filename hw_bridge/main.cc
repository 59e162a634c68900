#include <csignal>
#include <exception>
#include <string>

#include "components/framework/modules.h"
#include "components/framework/runners/component_main.h"
#include "components/framework/say_error.h"
#include "hw_bridge/hw_bridge.h"

namespace {

volatile std::sig_atomic_t emergency_stop = 0;
void OnEmergencyStop(int) { emergency_stop = 1; }

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = OnEmergencyStop;
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
  try {
    poise::LoadModules();  // their drive buses
    return poise::ComponentMain(argc, argv, poise::HwBridgeType(&emergency_stop));
  } catch (const std::exception& error) {
    poise::SayError(std::string("hw_bridge: ") + error.what());
    return 2;
  }
}
