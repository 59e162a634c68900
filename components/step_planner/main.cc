#include "components/framework/runners/component_main.h"
#include "components/step_planner/step_planner_type.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::StepPlannerType());
}
