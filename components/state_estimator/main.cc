#include "components/framework/runners/component_main.h"
#include "components/state_estimator/state_estimator_type.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::StateEstimatorType());
}
