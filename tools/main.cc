// The program `poise`: runs, checks and inspects process graphs.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <string>
#include <vector>

#include "components/framework/build_info.h"
#include "components/framework/modules.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/exit_code.h"
#include "tools/cli/output_style.h"
#include "tools/commands/commands.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

// The help tells them in this order.
constexpr void (*kCommands[])(CLI::App*, Command*) = {
    AddRunCommand,       AddMatrixCommand,    AddWorldsCommand, AddSweepCommand,  AddLimitCommand,
    AddLadderCommand,    AddBenchmarkCommand, AddReportCommand, AddBitsCommand,   AddCompareCommand,
    AddReplayCommand,    AddLogCommand,       AddNewCommand,    AddGraphCommand,  AddRobotCommand,
    AddListCommand,      AddRunsCommand,      AddDoctorCommand, AddDrivesCommand, AddEstopCommand,
    AddOperatorCommands, AddEchoCommand,      AddTopCommand,    AddViewCommand,   AddRos2Command,
    AddShellCommand};

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error that is told
  // What is opened later gets none of the standard streams' numbers, where one was closed: a
  // process started from here has its own streams there. What is printed still fails, but nobody
  // is there to hear of an error.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) >= 0) continue;
    if (open("/dev/null", fd == STDERR_FILENO ? O_WRONLY : O_RDONLY) != fd) return 2;
  }
  poise::UsePlainStreams();
  // Modules come before the commands, which tell what there is. Help and version are there without
  // them.
  std::exception_ptr modules;
  try {
    poise::LoadModules();
    poise::LoadDescriptions();
    poise::Components();
  } catch (...) {
    modules = std::current_exception();
  }
  CLI::App app{"Poise: balance of a torque-controlled humanoid by contact forces and moments",
               "poise"};
  app.formatter(poise::MakeHelpFormatter());  // before the commands, which take it over
  app.set_version_flag("--version", poise::VersionText("poise"));
  app.require_subcommand(1);
  app.footer(
      "poise COMMAND --help says more. Exit code: 0 good, 1 a check or the run failed, 2 "
      "wrong usage or configuration, 3 in real time, nothing failed but that processes were lost "
      "and replaced or the machine was late.\n"
      "Start with: poise run, then poise report");
  const auto say = [](const std::string& text) {
    return poise::ExitCodeOf([&] {
      fmt::print("{}", text);
      return poise::kExitOk;
    });
  };
  poise::Command command;
  for (const auto add : poise::kCommands) add(&app, &command);
  try {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    if (!arguments.empty() && arguments.front() == "help") {
      arguments.erase(arguments.begin());
      arguments.emplace_back("--help");
    }
    // An unset variable of a script: a default in its place would write elsewhere than was meant.
    if (const auto empty = std::ranges::find(arguments, ""); empty != arguments.end()) {
      poise::SayProblem(
          empty == arguments.begin()
              ? "the first argument is empty"
              : fmt::format("the argument after '{}' is empty; give it a value or leave it out",
                            *std::prev(empty)));
      return poise::kExitUsage;
    }
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
    app.parse(arguments);
  } catch (const CLI::CallForHelp&) {
    return say(poise::HelpText(app));
  } catch (const CLI::CallForVersion& version) {
    return say(fmt::format("{}\n", version.what()));
  } catch (const CLI::ParseError& error) {
    if (poise::WantsSubcommand(app, error)) {
      fmt::print("{}", poise::HelpText(app));
    } else {
      poise::SayProblem(poise::UsageProblem(app, error));
    }
    return poise::kExitUsage;
  }
  return poise::ExitCodeOf([&] {
    if (modules) std::rethrow_exception(modules);
    return command();
  });
}
