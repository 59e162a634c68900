// The subcommands of `poise`, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "tools/cli/exit_code.h"

namespace poise {

/// What the parsed command line asks for; returns the exit code.
using Command = std::function<int()>;

/// Adds a command to `parent`. Parsing it sets `command` to a call of `run` with its options, which
/// are returned beside it and live as long.
template <class Options, class Run>
std::pair<CLI::App*, Options*> AddCommand(CLI::App* parent, Command* command,
                                          const std::string& name, const std::string& description,
                                          Run run) {
  auto options = std::make_shared<Options>();
  CLI::App* const app = parent->add_subcommand(name, description);
  app->callback([=] { *command = [=] { return run(*options); }; });
  return {app, options.get()};
}

/// Adds one without options.
inline CLI::App* AddCommand(CLI::App* parent, Command* command, const std::string& name,
                            const std::string& description, const Command& run) {
  CLI::App* const app = parent->add_subcommand(name, description);
  app->callback([=] { *command = run; });
  return app;
}

/// Adds a command that only has commands below it.
inline CLI::App* AddGroup(CLI::App* parent, const std::string& name,
                          const std::string& description) {
  CLI::App* const app = parent->add_subcommand(name, description);
  app->require_subcommand(1);
  return app;
}

/// Each adds its subcommand; parsing it sets `command`, which may throw ConfigError (usage),
/// anything else (failure).
void AddRunCommand(CLI::App* app, Command* command);
void AddMatrixCommand(CLI::App* app, Command* command);
void AddWorldsCommand(CLI::App* app, Command* command);
void AddSweepCommand(CLI::App* app, Command* command);
void AddBenchmarkCommand(CLI::App* app, Command* command);
void AddLimitCommand(CLI::App* app, Command* command);
void AddLadderCommand(CLI::App* app, Command* command);
void AddReportCommand(CLI::App* app, Command* command);
void AddBitsCommand(CLI::App* app, Command* command);
void AddCompareCommand(CLI::App* app, Command* command);
void AddReplayCommand(CLI::App* app, Command* command);
void AddLogCommand(CLI::App* app, Command* command);
void AddNewCommand(CLI::App* app, Command* command);
void AddGraphCommand(CLI::App* app, Command* command);
void AddRobotCommand(CLI::App* app, Command* command);
/// `poise robot import`, a command of `robot`.
void AddRobotImport(CLI::App* robot, Command* command);
void AddRunsCommand(CLI::App* app, Command* command);
void AddListCommand(CLI::App* app, Command* command);
void AddDoctorCommand(CLI::App* app, Command* command);
void AddDrivesCommand(CLI::App* app, Command* command);
void AddEstopCommand(CLI::App* app, Command* command);
/// push, set, step and walk: acts on a run that goes on.
void AddOperatorCommands(CLI::App* app, Command* command);
void AddEchoCommand(CLI::App* app, Command* command);
void AddTopCommand(CLI::App* app, Command* command);
void AddViewCommand(CLI::App* app, Command* command);
void AddRos2Command(CLI::App* app, Command* command);
void AddShellCommand(CLI::App* app, Command* command);

}  // namespace poise
