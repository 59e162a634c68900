// The toy components as processes: toy_process TYPE --run FILE --component NAME.
#include "components/framework/runners/component_main.h"
#include "tests/framework/toy_components.h"

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  poise::ComponentRegistry registry;
  poise::AddToyComponents(&registry);
  const std::string type = argv[1];
  const poise::ComponentFactory* factory = registry.Find(type);
  if (factory == nullptr) return 2;
  return poise::ComponentMain(argc - 1, argv + 1, {type, "", *factory});
}
