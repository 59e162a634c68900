// The program does what `poise run [SCENARIO...]` without flags does. deploy/run builds it first on
// a new checkout, since all commands of `poise` take half as long again to compile.
#include <csignal>
#include <string>
#include <vector>

#include "components/framework/modules.h"
#include "tools/cli/exit_code.h"
#include "tools/cli/output_style.h"
#include "tools/run/several_runs.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/registry.h"

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error that is told
  poise::UsePlainStreams();
  return poise::ExitCodeOf([&] {
    poise::LoadModules();
    poise::LoadDescriptions();
    poise::Components();
    std::vector<std::string> scenarios(argv + 1, argv + argc);
    if (scenarios.empty()) scenarios = {poise::kFirstScenario};
    return poise::RunScenarios(scenarios, {}, "");
  });
}
