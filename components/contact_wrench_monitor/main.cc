#include "components/contact_wrench_monitor/contact_wrench_monitor_type.h"
#include "components/framework/runners/component_main.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::ContactWrenchMonitorType());
}
