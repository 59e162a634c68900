#include "components/contact_wrench_monitor/contact_wrench_monitor.h"
#include "components/framework/component_main.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "contact_wrench_monitor",
                              [] { return std::make_unique<poise::ContactWrenchMonitor>(); });
}
