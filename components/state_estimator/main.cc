#include <memory>

#include "components/framework/component_main.h"
#include "components/state_estimator/state_estimator.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "state_estimator",
                              [] { return std::make_unique<poise::StateEstimator>(); });
}
