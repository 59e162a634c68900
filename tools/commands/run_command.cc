
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/commands/commands.h"
#include "tools/live/interactive_run.h"
#include "tools/run/inline_run.h"
#include "tools/run/several_runs.h"
#include "tools/sweep/sweep_session.h"

namespace poise {
namespace {

struct RunArguments {
  std::vector<std::string> scenarios = {kFirstScenario};
  std::string out;
  RunOptions options;
  bool no_reference = false;
  bool interactive = false;
  bool count_allocations = false;
  InteractiveOptions page;
};

int Run(RunArguments arguments) {
  if (arguments.count_allocations) CountAllocations();
  if (arguments.interactive) {
    if (arguments.scenarios.size() != 1 || arguments.scenarios.front() == kAllScenarios) {
      throw ConfigError("--interactive: one scenario at a time");
    }
    arguments.options.in_process = true;
    arguments.options.interactive = [page = arguments.page](
                                        const RunSpec& spec, const Scenario& scenario,
                                        const run_info_t& info, const std::string& log) {
      return RunInteractive(spec, scenario, info, log, page);
    };
  }
  arguments.options.changes.reference = !arguments.no_reference;
  const std::string& capture = arguments.options.changes.capture;
  if (!capture.empty()) CheckFileFree("--capture", capture, arguments.options.force);
  return RunScenarios(arguments.scenarios, arguments.options, arguments.out);
}

}  // namespace

void AddRunCommand(CLI::App* app, Command* command) {
  const auto [run, arguments] =
      AddCommand<RunArguments>(app, command, "run", "run scenarios and check them", Run);
  RunOptions* const options = &arguments->options;
  run->footer(
      "Exit codes: 0 all checks hold; 1 a check or the run failed; 2 wrong usage or configuration; "
      "3 (real time) nothing failed but what the machine was too late for, or an injected fault "
      "took.\nExample: poise run push_double_support --set 'sim.push[0].peak=120'");
  run->add_option("scenario", arguments->scenarios,
                  "names (poise list scenarios) or .pbtxt files; all: every experiment of the "
                  "paper, by section, with an overview")
      ->capture_default_str();
  run->add_option("--out", arguments->out,
                  "folder of the run (of several: holds a folder each), new or empty; default: a "
                  "dated one under runs/");
  run->add_flag("--inline", options->in_process,
                "the same graph inside one process, without the network");
  run->add_flag("--count-allocations", arguments->count_allocations,
                "tell how often each stage allocates memory, which none should in a tick");
  run->add_flag("--interactive", arguments->interactive,
                "in one process at wall speed with a page in control: push, change settings, "
                "pause, single ticks, slow motion, back; Ctrl-C ends");
  run->add_option("--port", arguments->page.port, "of that page, on 127.0.0.1; default: a free one")
      ->check(CLI::Range(1, 65535));
  run->add_flag("--hosted", options->changes.hosted,
                "the whole controller in one process: what the graph marks restart: true passes "
                "its messages in memory, and sends them to all others as ever");
  AddList(run, "--host", &options->changes.host,
          "put these components of the graph into one process of that name", "PROCESS=A,B,...");
  run->add_flag("--realtime", options->changes.realtime,
                "the bridge owns the clock and holds the last "
                "command; processes that die are replaced. "
                "With --inline: pace the ticks with the wall clock");
  run->add_option(
         "--kill", options->launch.kills.count,
         "faults to inject: as often a controller process is killed, or stopped for 100 ms")
      ->check(Within("in [1, 10000]", [](double n) { return n >= 1 && n <= 10000; }));
  run->add_option("--priority", options->changes.priority,
                  "of the bridge under SCHED_FIFO, where the system grants it (default 40); 0: the "
                  "ordinary scheduler")
      ->check(CLI::Range(0, 98));
  run->add_option("--cpu", options->changes.cpu,
                  "that the controller is pinned to under SCHED_FIFO; default: the last one")
      ->check(CLI::Range(0, 1023));
  KillOptions* const kills = &options->launch.kills;
  run->add_option("--kill-seed", kills->seed, "of the moments and processes of --kill")
      ->check(Whole())
      ->capture_default_str();
  run->add_option("--kill-from", kills->from,
                  "first time of a fault, s of the scenario; negative: while the robot starts")
      ->capture_default_str();
  run->add_option("--kill-until", kills->until,
                  "last time of a fault, s of the scenario (default: its end)");
  run->add_option("--drives", options->changes.drives,
                  "what moves the simulated robot's motors; ethercat: an emulated chain of "
                  "servo drives, through real EtherCAT frames; unitree: an emulated G1 or H1-2, "
                  "over DDS")
      ->check(CLI::IsMember(EmulatedDrives()));
  run->add_option("--link", options->changes.link,
                  "of EtherCAT: udp (default), or raw:MASTER,DRIVES, two network interfaces; see "
                  "deploy/veth");
  run->add_option("--capture", options->changes.capture,
                  "write every EtherCAT frame to this file, for Wireshark");
  run->add_flag("--ros2", options->ros2,
                "tell ROS 2 of the run over DDS: poise ros2 beside it, in domain ROS_DOMAIN_ID");
  AddChangeOptions(run, &options->changes,
                   "change a field of the scenario, e.g. --set sim.push[0].peak=120 or "
                   "--set 'check[push_peak].at_most=200' (poise list fields); "
                   "no value: empties a list or group, unsets a number without default");
  run->add_flag("--no-reference", arguments->no_reference,
                "do not run the scenario's reference variant beside it");
  run->add_option("--robot", options->changes.robot,
                  "a name (poise list robots), a robot's folder or its .pbtxt file; default: the "
                  "scenario's");
  AddWorld(run, &options->changes.world, "the scenario's");
  run->add_option("--seed", options->changes.seed, "of all noise")->check(Whole());
  run->add_option("--drop", options->changes.drop_rate,
                  "share of the messages that each process drops, to test the recovery; each is "
                  "asked for after 2 ms or more, so that 0.5 makes a tick take 0.1 s and more")
      ->check(Within("in [0, 0.9]", [](double share) { return share >= 0 && share <= 0.9; }));
  run->add_flag(
      "!--no-log", options->launch.log,
      "write no log, for a run of hours: nothing is checked but that it stands to the end");
  run->add_flag("--force", options->force,
                "replace the run that --out holds, or the file of --capture; start though the log "
                "may not fit the disk");
  run->add_flag("--quiet", options->quiet, "only errors and the verdict, in one line");
  run->add_flag("--full", options->full, "every figure, the events and the assumptions");
  // CLI11 checks these, and its help names them at each flag.
  using Flags = std::initializer_list<const char*>;
  const auto exclude = [app = run](const char* excluded, Flags flags) {
    for (const char* const flag : flags) app->get_option(flag)->excludes(app->get_option(excluded));
  };
  exclude("--quiet", {"--full"});
  exclude("--inline", {"--interactive", "--hosted", "--host", "--kill", "--drives", "--ros2",
                       "--drop", "--no-log"});
  exclude("--interactive", {"--hosted", "--host", "--realtime", "--drives", "--drop", "--no-log"});
  const auto need = [app = run](const char* needed, Flags flags) {
    for (const char* const flag : flags) app->get_option(flag)->needs(app->get_option(needed));
  };
  need("--inline", {"--count-allocations"});
  need("--interactive", {"--port"});
  need("--realtime", {"--kill", "--priority", "--cpu", "--kill-from", "--kill-until"});
  need("--drives", {"--link", "--capture"});
  const auto group = [app = run](const char* name, Flags flags) {
    for (const char* const flag : flags) app->get_option(flag)->group(name);
  };
  group("What is run", {"--variant", "--without", "--ideal", "--no-reference", "--robot", "--world",
                        "--set", "--duration", "--seed"});
  group("In which processes", {"--inline", "--count-allocations", "--interactive", "--port",
                               "--hosted", "--host", "--drop", "--no-log"});
  group("In real time", {"--realtime", "--priority", "--cpu", "--kill", "--kill-seed",
                         "--kill-from", "--kill-until"});
  group("Drives and ROS 2", {"--drives", "--link", "--capture", "--ros2"});
}

}  // namespace poise
