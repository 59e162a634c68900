#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <map>
#include <optional>
#include <span>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/configuration/text_pattern.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "logging/log_messages.h"
#include "logging/printable.h"
#include "logging/replay/component_replay.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/progress.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/report/html_report.h"
#include "tools/report/run_screen.h"
#include "tools/run/run_dir.h"
#include "tools/run/scenario_run.h"
#include "tools/run/stage_watch.h"
#include "tools/scenario/former_fields.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using logging::ForTerminal;

// liblcm's default, where its tools listen without options.
constexpr char kDefaultUrl[] = "udpm://239.255.76.67:7667?ttl=0";

struct ReplayOptions {
  std::string run;
  std::vector<std::string> components;
  std::vector<std::string> set;
  std::string out;
  bool force = false;
  bool to_bus = false;
  double speed = 1;
  std::string url;
};

/// Indexes in the graph of the components asked for; all when none is.
std::vector<int> Wanted(const RunSpec& spec, const std::vector<std::string>& names) {
  const std::vector<std::string> known = NamesOf(spec.graph().component());
  for (const std::string& name : names) {
    if (!IsAmong(name, known)) {
      throw ConfigError(fmt::format("--component {}: the log's graph has none of that name; {}",
                                    name, Suggest(name, known)));
    }
  }
  std::vector<int> wanted;
  for (size_t i = 0; i < known.size(); ++i) {
    if (names.empty() || IsAmong(known[i], names)) {
      wanted.push_back(static_cast<int>(i));
    }
  }
  return wanted;
}

void Print(const logging::ReplayedComponent& component, const logging::LogMessages& messages) {
  const double simulated = static_cast<double>(component.ticks) * messages.spec().tick_period();
  fmt::print("{}: {} ticks in {:.3f} s, {:.0f} x real time: {}\n", ForTerminal(component.name),
             component.ticks, component.wall_time, simulated / std::max(component.wall_time, 1e-9),
             component.equal() ? "equal" : "DIFFERENT");
  if (component.unplaced_messages > 0) {
    fmt::print(
        "  {} of {} external messages: the log does not tell the tick that they were read in, "
        "only between which they came; differences after them may come of that\n",
        component.unplaced_messages, component.external_messages);
  }
  if (component.skipped_ticks > 0 || component.late_inputs > 0) {
    fmt::print(
        "  in real time it was too late for {} ticks, and {} of its inputs came too late by the "
        "log's order; differences may come of that\n",
        component.skipped_ticks, component.late_inputs);
  }
  for (const logging::ReplayedChannel& output : component.outputs) {
    if (output.ticks == 0) {
      fmt::print("  {}: nothing to compare with: this run had no such channel\n",
                 ForTerminal(output.channel));
      continue;
    }
    if (output.differing == 0) {
      fmt::print("  {}: {} messages, the same bits\n", ForTerminal(output.channel), output.ticks);
      continue;
    }
    fmt::print("  {}: {} of {} messages differ, first {} at tick {}\n", ForTerminal(output.channel),
               output.differing, output.ticks,
               ForTerminal(messages.Label(output.channel, output.first_field)),
               output.first_differing_tick);
    for (const logging::FieldDifference& field : output.fields) {
      fmt::print(
          "    {}: {} ticks, from {} on; largest {:.3g}: {} at tick {}, logged {}, "
          "replayed {}\n",
          field.field, field.ticks, field.first_tick, field.largest,
          ForTerminal(messages.Label(output.channel, field.largest_path)), field.largest_tick,
          ForTerminal(field.logged), ForTerminal(field.replayed));
    }
  }
}

/// Makes a run's folder of what was replayed: its log, table and page.
void WriteRun(const ReplayOptions& options, const std::string& log, const fs::path& dir,
              const logging::LogReplay& replay, const RunSpec& spec,
              const logging::ChangedMessages& changed) {
  run_info_t info = replay.info();
  RunSpec run_spec = replay.spec();  // its graph, which tells what the log holds
  *run_spec.mutable_config() = spec.config();
  google::protobuf::TextFormat::PrintToString(run_spec, &info.run_spec);
  Scenario scenario = LoggedScenario(info.scenario, log + ": RUN_INFO.scenario");
  for (const std::string& set : options.set) {
    const size_t equals = set.find('=');
    SetField(&scenario, set.substr(0, equals), set.substr(equals + 1));
    Applied::Change* const change = scenario.mutable_applied()->add_change();
    change->set_by("--set");
    change->set_set(set);
  }
  info.scenario = ScenarioText(scenario);
  WriteRunFiles(dir, info);
  replay.Write(dir / "run.lcm", info, changed);
  if (const fs::path reference = ReferenceDir(fs::path(log).parent_path());
      fs::exists(reference / "run.lcm")) {
    fs::copy(reference, ReferenceDir(dir), fs::copy_options::recursive);
  }
  StageLine line(/*quiet=*/false);
  std::vector<ReportedRun> runs;
  runs.push_back(ReadReportedRun(dir, &line));
  const ReportedRun& run = runs.front();
  RunSummary summary;
  summary.mode = "replay";
  summary.outcome.completed = true;
  summary.checks = run.checks;
  summary.events = logging::Events(run.record);
  summary.passed = ChecksPass(run.checks);
  WriteFile(dir / "summary.json", SummaryJson(run.scenario, run.record, summary));
  fmt::print("\n{}\n{}", FormatScreen({run.scenario, run.record, run.checks, summary.events, ""}),
             FormatVerdictLines(run.scenario, run.checks, "", /*below_full_table=*/false));
  WriteHtmlReport(dir / "report.html", runs);
  fmt::print("\nWhat was replayed, step by step: {}\n", FileAddress(dir / "report.html"));
}

int CompareReplay(const ReplayOptions& options, const std::string& log) {
  const logging::LogReplay replay(log);
  RunSpec spec = replay.spec();
  ChangeConfigurations(options.set, &spec);
  std::optional<RunDir> dir;
  if (std::error_code error; fs::equivalent(options.out, fs::path(log).parent_path(), error)) {
    throw ConfigError(fmt::format("--out {}: is the folder of the log itself", options.out));
  }
  if (!options.out.empty()) dir.emplace(MakeRunDir(options.out, spec.scenario(), options.force));
  logging::ChangedMessages changed;
  const logging::LogMessages messages(log);
  bool equal = true, replayed = false;
  for (const int index : Wanted(spec, options.components)) {
    if (const std::string why = WhyNotReplayed(spec, index); !why.empty()) {
      fmt::print("{}: not replayed: {}\n", ForTerminal(spec.graph().component(index).name()),
                 ForTerminal(why));
      continue;
    }
    replayed = true;
    std::optional<StageWatch> watch;
    const logging::ReplayedComponent component =
        replay.Replay(spec, index, Components(), dir ? &changed : nullptr,
                      [&](const std::vector<std::string>& names) {
                        std::vector<InlineRunner::StageName> stages;
                        for (const std::string& stage : names) {
                          stages.push_back({spec.graph().component(index).name(), stage});
                        }
                        return watch.emplace(spec, stages, [] { return ""; }).position();
                      });
    watch.reset();
    Print(component, messages);
    equal = equal && component.equal();
  }
  // A comparison of nothing would say that all is equal.
  if (!replayed) fmt::print("nothing was replayed\n");
  if (dir && replayed) WriteRun(options, log, dir->path(), replay, spec, changed);
  return equal && replayed ? kExitOk : kExitFailed;
}

struct PlayedEvent {
  int64_t tick;
  std::string channel;
  std::span<const uint8_t> data;
};

/// The messages of the graph's channels and of HEALTH_*, in the order of their ticks.
std::vector<PlayedEvent> PlayedEvents(logging::LogMessages* messages) {
  const RunSpec& spec = messages->spec();
  std::map<std::string, logging::ChannelTicks, std::less<>> own_ticks;
  for (const Channel& channel : spec.graph().channel()) {
    if (!channel.external()) {
      own_ticks.emplace(channel.name(),
                        logging::ChannelTicks(spec, channel, messages->reader().file_size()));
    }
  }
  std::vector<PlayedEvent> events;
  logging::LogEvent event;
  int64_t newest = spec.cut().first_tick();
  while (messages->reader().Next(&event)) {
    const MessageType* const type = messages->TypeOf(event);
    if (type == nullptr || event.channel == logging::kRunInfoChannel) continue;
    const auto own = own_ticks.find(event.channel);
    // What has no tick of its own keeps its place among the others.
    std::optional<int64_t> tick = newest;
    if (own != own_ticks.end()) tick = own->second.Check(event.data);
    if (!tick) continue;
    newest = std::max(newest, *tick);
    events.push_back({*tick, std::string(event.channel), event.data});
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const PlayedEvent& a, const PlayedEvent& b) { return a.tick < b.tick; });
  return events;
}

/// Waits until `due` (ns); false: stopped.
bool WaitUntil(int64_t due) {
  constexpr int64_t kLongestSleep = 50'000'000;  // ns, so that a stop is soon seen
  for (int64_t now = NowNanoseconds(); now < due; now = NowNanoseconds()) {
    if (StopSignal() != 0) return false;
    const int64_t wake = std::min(due, now + kLongestSleep);
    const timespec deadline{wake / 1'000'000'000, wake % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
  }
  return StopSignal() == 0;
}

/// Sends the log's messages as the recorder mirrors them: those of tick t at t ticks' time / speed
/// after the start.
int Play(const ReplayOptions& options, const std::string& log) {
  logging::LogMessages messages(log);
  const RunSpec& spec = messages.spec();
  std::string url = options.url;
  if (url.empty()) url = spec.has_first_port() ? MirrorUrl(spec) : kDefaultUrl;  // no network
  fmt::print("playing {} at {}, {} x real time\n", log, url, options.speed);
  std::fflush(stdout);
  CatchStopSignals();
  const std::vector<PlayedEvent> events = PlayedEvents(&messages);
  BusSender bus(url);
  int64_t sent = 0, failed = 0;
  double played = 0;  // s of the run
  const int64_t start = NowNanoseconds();
  for (const PlayedEvent& event : events) {
    const double time = static_cast<double>(event.tick - events.front().tick) * spec.tick_period();
    if (!WaitUntil(start + static_cast<int64_t>(time / options.speed * 1e9))) break;
    ++(bus.Send(event.channel.c_str(), event.data.data(), event.data.size()) ? sent : failed);
    played = time;
  }
  fmt::print("{} messages, {:.3f} s of the run{}\n", sent, played,
             StopSignal() != 0 ? "; interrupted" : "");
  if (failed > 0) {
    fmt::print(stderr, "poise: {} messages could not be sent; see poise doctor\n", failed);
  }
  return failed > 0 || StopSignal() != 0 ? kExitFailed : kExitOk;
}

int Replay(const ReplayOptions& options) {
  const std::string log = FindLog(options.run).string();
  WarnOfRunInfo(log);
  return options.to_bus ? Play(options, log) : CompareReplay(options, log);
}

}  // namespace

void AddReplayCommand(CLI::App* app, Command* command) {
  const auto [replay, options] = AddCommand<ReplayOptions>(
      app, command, "replay",
      "feed a log's messages to the components again and compare what they give with what was "
      "logged, bit for bit (exit code 1 when it differs)",
      Replay);
  replay->footer(
      "Configurations, robot and seed are those of the log. The components are those of this "
      "program, so that a changed build shows where it differs. What cannot be replayed (a program "
      "of its own, an object of Python's, an end of the drives) is named and not judged.\nExample: "
      "poise replay runs/latest "
      "--component task_controller --set task_controller.com.kp=200");
  replay->add_option("run", options->run, "folder of a run or a log; default: the latest run");
  CLI::Option* component = AddList(replay, "--component", &options->components,
                                   "component to replay, more than once for several; default: all");
  CLI::Option* set = AddList(replay, "--set", &options->set,
                             "change a field of a configuration (poise list fields), e.g. --set "
                             "task_controller.com.kp=200",
                             "FIELD=VALUE");
  CLI::Option* out =
      replay->add_option("--out", options->out,
                         "write a run's folder of it, new or empty: the log, with what came out "
                         "otherwise in its place, its table and its page");
  replay->add_flag("--force", options->force, "replace the run that --out holds")->needs(out);
  CLI::Option* to_bus = replay->add_flag(
      "--to-bus", options->to_bus,
      "send the messages to the run's public URL instead, for lcm-spy and the like");
  to_bus->excludes(component)->excludes(set)->excludes(out);
  replay->add_option("--speed", options->speed, "of --to-bus: times real time")
      ->check(CLI::Range(1e-3, 1e6))
      ->needs(to_bus)
      ->capture_default_str();
  replay
      ->add_option("--url", options->url,
                   fmt::format("of --to-bus: LCM URL instead of the run's public one; default of a "
                               "run inside one process: LCM's own, {}",
                               kDefaultUrl))
      ->needs(to_bus)
      ->check(CLI::Validator(
          [](const std::string& url) {
            constexpr char kForm[] = R"(^udpm://\d+\.\d+\.\d+\.\d+:\d+(\?ttl=\d+)?$)";
            return Matches(url, kForm).empty() ? url + ": must be udpm://GROUP:PORT?ttl=TTL" : "";
          },
          ""));
}

}  // namespace poise
