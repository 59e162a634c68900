#include "components/framework/component_main.h"
#include "components/task_controller/task_controller.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "task_controller",
                              [] { return std::make_unique<poise::TaskController>(); });
}
