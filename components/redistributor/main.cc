#include "components/framework/runners/component_main.h"
#include "components/redistributor/redistributor_type.h"

int main(int argc, char** argv) {
  return poise::ComponentMain(argc, argv, poise::RedistributorType());
}
