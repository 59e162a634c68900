// The program `poise`: runs, checks and inspects process graphs.
#include <cstdio>

#include "components/framework/build_info.h"
#include "components/framework/configuration.h"
#include "components/robot/robot_model.h"
#include "deploy/poise/commands.h"
#include "fmt/format.h"
#include "logging/printable.h"

int main(int argc, char** argv) {
  CLI::App app{"Poise: balance of a torque-controlled humanoid by contact forces and moments",
               "poise"};
  app.set_version_flag("--version", poise::VersionText("poise"));
  app.require_subcommand(1);
  app.footer(
      "poise COMMAND --help says more. Exit code: 0 good, 1 a check or the run failed, 2 "
      "wrong usage or configuration.");
  poise::Command command;
  poise::AddRunCommand(&app, &command);
  poise::AddMatrixCommand(&app, &command);
  poise::AddSweepCommand(&app, &command);
  poise::AddLimitCommand(&app, &command);
  poise::AddReportCommand(&app, &command);
  poise::AddBitsCommand(&app, &command);
  poise::AddCompareCommand(&app, &command);
  poise::AddReplayCommand(&app, &command);
  poise::AddEstimatorsCommand(&app, &command);
  poise::AddLogCommand(&app, &command);
  poise::AddNewCommand(&app, &command);
  poise::AddGraphCommand(&app, &command);
  poise::AddListCommand(&app, &command);
  poise::AddDoctorCommand(&app, &command);
  poise::AddEstopCommand(&app, &command);
  poise::AddEchoCommand(&app, &command);
  poise::AddTopCommand(&app, &command);
  poise::AddViewCommand(&app, &command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "poise: {}; see poise --help\n", error.what());
    return poise::kExitUsage;
  }
  try {
    return command();
  } catch (const poise::ConfigError& error) {
    fmt::print(stderr, "poise: {}\n", poise::logging::LinesForTerminal(error.what()));
    return poise::kExitUsage;
  } catch (const poise::robot::RobotError& error) {
    fmt::print(stderr, "poise: {}\n", poise::logging::LinesForTerminal(error.what()));
    return poise::kExitUsage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "poise: {}\n", poise::logging::LinesForTerminal(error.what()));
    return poise::kExitFailed;
  }
}
