#include <functional>
#include <string>

#include "components/framework/build_info.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/shell_text.h"
#include "tools/commands/commands.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

int PrintNames(const std::string& kind) {
  for (const std::string& name : ListNames(kind)) fmt::print("{}\n", name);
  return kExitOk;
}

}  // namespace

void AddShellCommand(CLI::App* app, Command* command) {
  CLI::App* const shell =
      AddGroup(app, "shell", "print the manual page, or completion for a shell");
  const auto add = [&](const char* name, const char* description, const std::string& example,
                       std::function<std::string(const CLI::App&)> text) {
    const Command print = [app, text = std::move(text)] {
      fmt::print("{}", text(*app));
      return kExitOk;
    };
    SetExample(AddCommand(shell, command, name, description, print),
               fmt::format("poise shell {} {}", name, example));
  };
  add("man", "the manual page", "| man -l -",
      [](const CLI::App& root) { return ManPage(root, fmt::format("poise {}", PoiseVersion())); });
  add("bash", "completion: source <(poise shell bash)", "> poise.bash", BashCompletion);
  add("zsh", "completion, for a folder of $fpath", "> _poise", ZshCompletion);
  add("fish", "completion", "| source", FishCompletion);

  const auto [names, kind] = AddCommand<std::string>(
      shell, command, "names", "what there is of a kind, a line each", PrintNames);
  names->add_option("kind", *kind, "scenarios, robots, graphs, sweeps or drives")
      ->required()
      ->check(CLI::IsMember({"scenarios", "robots", "graphs", "sweeps", "drives"}));
  SetExample(names, "poise shell names scenarios");
}

}  // namespace poise
