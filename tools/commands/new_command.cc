#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_place.h"
#include "tools/commands/commands.h"
#include "tools/scenario/new_scenario.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct NewOptions {
  std::string name;
  std::string from;
};

/// Makes the file. Throws ConfigError when there is one of that name, or it cannot be made.
void WriteNewFile(const fs::path& file, const std::string& text) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) {
    throw ConfigError(fmt::format(
        "{}: {}", file.string(),
        errno == EEXIST ? "is there already; choose another name" : std::strerror(errno)));
  }
  close(fd);
  WriteFile(file, text);
}

int NewScenario(const NewOptions& options) {
  std::string name = options.name;
  if (name.ends_with(".pbtxt")) name.resize(name.size() - 6);
  const auto in_name = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), in_name)) {
    throw ConfigError(fmt::format(
        "new scenario: '{}' must consist of letters, digits, _ and -; the file is written into the "
        "current folder",
        options.name));
  }
  const fs::path file = fs::current_path() / (name + ".pbtxt");
  WriteNewFile(file, NewScenarioText(name, options.from, fs::current_path()));
  const LoadedScenario loaded = LoadScenario(file.string(), {});
  fmt::print(
      "{}: {}\n  to run it:    poise run {}\n  to check it:  poise graph check {}\n"
      "  the fields:   poise list fields [NAME]\n",
      file.filename().string(), loaded.scenario.description(), file.filename().string(),
      file.filename().string());
  return kExitOk;
}

}  // namespace

void AddNewCommand(CLI::App* app, Command* command) {
  CLI::App* const make = AddGroup(app, "new", "write a file of your own to begin with");
  const auto [scenario, options] =
      AddCommand<NewOptions>(make, command, "scenario",
                             "a commented scenario, NAME.pbtxt in the current folder", NewScenario);
  scenario->add_option("name", options->name, "letters, digits, _ and -")->required();
  scenario->add_option("--from", options->from,
                       "a copy of this scenario, a name or a .pbtxt file (poise list scenarios)");
  SetExample(scenario, "poise new scenario my_push --from push_double_support");
}

}  // namespace poise
