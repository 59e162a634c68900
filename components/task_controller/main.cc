#include "components/framework/runners/component_main.h"
#include "components/task_controller/task_controller_type.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::TaskControllerType());
}
