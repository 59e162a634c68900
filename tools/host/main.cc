// The program that runs components which share a process: all types that this program knows, and
// those of modules.
#include "components/framework/modules.h"
#include "components/framework/runners/component_main.h"
#include "components/framework/say_error.h"
#include "fmt/format.h"
#include "tools/scenario/registry.h"

int main(int argc, char** argv) {
  try {
    poise::LoadModules();
    return poise::HostMain(argc, argv, poise::Components());
  } catch (const std::exception& error) {
    poise::SayError(fmt::format("{}: {}", poise::kHostProgram, error.what()));
    return 2;
  }
}
