#include "components/framework/runners/component_main.h"

#include <sys/prctl.h>

#include <csignal>
#include <optional>
#include <string>

#include "components/framework/bus/run_socket.h"
#include "components/framework/component_description.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/framework/runners/process_runner.h"
#include "components/framework/runners/program_options.h"
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

/// Where a process's program finds what it is to do.
struct Arguments {
  std::string run_file;
  std::string name;  ///< of a component or of a process
  std::string state;
  bool standby = false;
  int socket = -1;
};

/// The options that every process has, and `own`.
std::vector<ProgramOption> OptionsOf(Arguments* arguments, const std::vector<ProgramOption>& own) {
  std::vector<ProgramOption> options = {
      {"--run", &arguments->run_file, "the run: protobuf text of poise.RunSpec", true},
      {"--state", &arguments->state, "file that keeps the state for a process that takes over"},
      {"--standby", &arguments->standby,
       "wait for SIGUSR2, then take the place of a process that died", false, "--state"},
      {"--socket", &arguments->socket, "descriptor of the run's socket; default: it is asked for"}};
  options.insert(options.end(), own.begin(), own.end());
  return options;
}

/// Runs the process that `find` names; returns the exit code.
template <class Find>
int RunProcess(const Arguments& arguments, const ComponentRegistry& registry, const Find& find) {
  try {
    RunSpec spec;
    ReadTextProto(arguments.run_file, &spec);
    std::optional<RunSocket> socket;
    if (arguments.socket >= 0) socket.emplace(spec, arguments.socket);
    ProcessRunnerOptions options;
    options.stop = &stop_asked;
    options.socket = socket ? &*socket : nullptr;
    options.state_path = arguments.state;
    if (arguments.standby) options.take_over = &take_over_asked;
    ProcessRunner runner(spec, find(spec), registry, options);
    if (runner.Run()) return 0;
    SayError(fmt::format("{}: {}", arguments.name, runner.error()));
    return 1;
  } catch (const ConfigError& error) {
    SayError(fmt::format("{}: {}", arguments.name, error.what()));
    return 2;
  } catch (const std::exception& error) {
    SayError(fmt::format("{}: {}", arguments.name, error.what()));
    return 1;
  }
}

/// The process of component `name`, which this program of one type can run alone.
std::string ProcessOfComponent(const RunSpec& spec, const std::string& name,
                               const std::string& type) {
  std::vector<std::string> names;
  for (const ComponentInstance& instance : spec.graph().component()) {
    names.push_back(instance.name());
    if (instance.name() != name) continue;
    if (TypeOf(instance) != type) {
      throw ConfigError(fmt::format("component {} is of type {}; this program is {}", name,
                                    TypeOf(instance), type));
    }
    if (ComponentsOf(spec.graph(), ProcessOf(instance)).size() > 1) {
      throw ConfigError(
          fmt::format("component {} shares process {} with others; run: {} --process "
                      "{}",
                      name, ProcessOf(instance), kHostProgram, ProcessOf(instance)));
    }
    return ProcessOf(instance);
  }
  throw ConfigError(fmt::format("graph {}: has no component '{}'; it has {}", spec.graph().name(),
                                name, fmt::join(names, ", ")));
}

}  // namespace

int ComponentMain(int argc, char** argv, const ComponentType& of) {
  CatchSignals();
  Arguments arguments;
  arguments.name = of.name;
  const std::optional<int> code = ParseProgram(
      argc, argv, of.name,
      fmt::format("One process of a Poise run: component {}. Usually started by `poise run`.",
                  of.name),
      OptionsOf(&arguments,
                {{"--component", &arguments.name, "name of this component in the run's graph"},
                 {"--describe", [&of] { fmt::print("{}\n", DescriptionOf(of).dump(2)); },
                  "print ports, settings and properties as JSON, and do nothing else"}}));
  if (code) return *code;
  ComponentRegistry registry;
  registry.Add(of);
  return RunProcess(arguments, registry, [&](const RunSpec& spec) {
    return ProcessOfComponent(spec, arguments.name, of.name);
  });
}

int HostMain(int argc, char** argv, const ComponentRegistry& registry) {
  CatchSignals();
  Arguments arguments;
  const std::optional<int> code = ParseProgram(
      argc, argv, kHostProgram,
      "One process of a Poise run: all components that share it. Usually started by `poise run`.",
      OptionsOf(&arguments,
                {{"--process", &arguments.name, "name of the process in the run's graph", true}}));
  if (code) return *code;
  return RunProcess(arguments, registry, [&](const RunSpec&) { return arguments.name; });
}

int ModuleComponentMain(int argc, char** argv, const char* type, void (*module)()) {
  try {
    module();
    for (const ComponentType& each : AddedComponents()) {
      if (each.name == type) return ComponentMain(argc, argv, each);
    }
    SayError(fmt::format("{}: its POISE_MODULE adds no component of this name", type));
  } catch (const std::exception& error) {
    SayError(fmt::format("{}: {}", type, error.what()));
  }
  return 2;
}

}  // namespace poise
