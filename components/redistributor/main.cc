#include "components/framework/component_main.h"
#include "components/redistributor/redistributor.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, "redistributor",
                              [] { return std::make_unique<poise::Redistributor>(); });
}
