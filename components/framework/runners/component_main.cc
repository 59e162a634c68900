#include "components/framework/runners/component_main.h"

#include <sys/prctl.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "components/framework/build_info.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/run.h"
#include "components/framework/runners/process_runner.h"
#include "components/framework/say_error.h"
#include "fmt/format.h"

namespace poise {
namespace {

volatile std::sig_atomic_t stop_asked = 0;
volatile std::sig_atomic_t take_over_asked = 0;

void OnSignal(int) { stop_asked = 1; }
void OnTakeOver(int) { take_over_asked = 1; }

void CatchSignals() {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = OnTakeOver;
  sigaction(SIGUSR2, &action, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  prctl(PR_SET_TIMERSLACK, 1000);  // ns: deadlines of a tick are not to be rounded to 50 us
}

}  // namespace

int ComponentMain(int argc, char** argv, const ComponentType& of) {
  const std::string& type = of.name;
  CatchSignals();
  std::string run_file;
  std::string name = type;
  CLI::App app{
      fmt::format("One process of a Poise run: component {}. Usually started by `poise run`.",
                  type),
      type};
  app.set_version_flag("--version", VersionText(type));
  app.add_option("--run", run_file, "the run: protobuf text of poise.RunSpec")->required();
  app.add_option("--component", name, "name of this component in the run's graph")
      ->capture_default_str();
  std::string state;
  bool standby = false;
  CLI::Option* const state_option = app.add_option(
      "--state", state, "file that keeps the component's state for a process that takes over");
  app.add_flag("--standby", standby, "wait for SIGUSR2, then take the place of a process that died")
      ->needs(state_option);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    SayError(fmt::format("{}: {}; see {} --help", type, error.what(), type));
    return 2;
  }
  try {
    RunSpec spec;
    ReadTextProto(run_file, &spec);
    for (const ComponentInstance& instance : spec.graph().component()) {
      if (instance.name() == name && TypeOf(instance) != type) {
        throw ConfigError(fmt::format("component {} is of type {}; this program is {}", name,
                                      TypeOf(instance), type));
      }
    }
    ProcessRunnerOptions options;
    options.stop = &stop_asked;
    options.state_path = state;
    if (standby) options.take_over = &take_over_asked;
    ProcessRunner runner(spec, name, of.make, options);
    if (runner.Run()) return 0;
    SayError(fmt::format("{}: {}", name, runner.error()));
    return 1;
  } catch (const ConfigError& error) {
    SayError(fmt::format("{}: {}", name, error.what()));
    return 2;
  } catch (const std::exception& error) {
    SayError(fmt::format("{}: {}", name, error.what()));
    return 1;
  }
}

}  // namespace poise
