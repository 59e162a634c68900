#include <cmath>
#include <memory>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/export/log_export.h"
#include "logging/log_cut.h"
#include "logging/log_sums.h"
#include "logging/log_survey.h"
#include "logging/printable.h"
#include "logging/replay/log_pack.h"
#include "logging/run_info.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_place.h"
#include "tools/cli/output_style.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/foxglove/mcap_scene.h"
#include "tools/run/remake.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/former_fields.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using logging::ForTerminal;

constexpr size_t kPlaces = 20;  // named of each kind of problem, without --all

void PrintRow(const logging::ChannelSurvey& channel, double duration) {
  const logging::ChannelCompleteness& ticks = channel.ticks;
  const std::string rate =
      duration > 0 && ticks.messages > 1
          ? fmt::format("{:.1f}", static_cast<double>(ticks.messages) / duration)
          : "";
  fmt::print("{:<30} {:<18} {:>9} {:>9} {:>10}\n", ForTerminal(ticks.name),
             channel.type.empty() ? "(not known)" : channel.type, ticks.messages, rate,
             FormatBytes(channel.bytes));
}

/// "field: value" lines of the run.
void PrintRun(const logging::LogSurvey& survey) {
  const RunSpec& spec = survey.spec;
  std::string versions = "poise " + spec.poise_version();
  if (!spec.poise_commit().empty()) versions += " (commit " + spec.poise_commit() + ")";
  for (const std::string& version : spec.library_version()) versions += ", " + version;
  if (!spec.instruction_set().empty()) versions += "; built for " + spec.instruction_set();
  const int64_t ticks = survey.end_tick - survey.first_tick;
  const auto wrapped = [](const std::string& line) {
    return Wrapped(line, ScreenStyle().columns, 10);
  };
  fmt::print("scenario  {}\nrun       {}\nseed      {}\nstarted   {}\n{}\n",
             ForTerminal(spec.scenario()), spec.run_id(), spec.seed(),
             ForTerminal(survey.info.started_at), wrapped("versions  " + ForTerminal(versions)));
  fmt::print("duration  {:.3f} s in the log, {} ticks of {:g} s from tick {}; {} planned\n",
             static_cast<double>(ticks) * spec.tick_period(), ticks, spec.tick_period(),
             survey.first_tick, spec.num_ticks());
  try {
    const std::string changes =
        FormatChanges(LoggedScenario(survey.info.scenario, "RUN_INFO.scenario"));
    if (!changes.empty()) fmt::print("changed   {}\n", logging::LinesForTerminal(changes));
  } catch (const ConfigError& error) {
    fmt::print("changed   not known: {}\n", ForTerminal(error.what()));
  }
  if (spec.drop_rate() > 0)
    fmt::print("dropped   {} of the messages, on purpose\n", spec.drop_rate());
  if (spec.realtime()) fmt::print("paced     with the wall clock\n");
  if (spec.lead_ticks() > 0) {
    fmt::print("lead      the scenario's time 0 is tick {}\n", spec.lead_ticks());
  }
  if (spec.has_cut()) {
    fmt::print("cut       from a longer log: ticks {} to {}{}\n", spec.cut().first_tick(),
               spec.cut().last_tick(), spec.cut().channel().empty() ? "" : ", not all channels");
  }
}

struct LogOptions {
  std::string run;
};

int Info(const LogOptions& options) {
  const std::string log = FindLog(options.run).string();
  const logging::LogSurvey survey = logging::SurveyLog(log);
  if (survey.events == 0) {
    throw ConfigError(fmt::format("{}: is no event log: it holds no event", log));
  }
  fmt::print("log       {}, {}, {} events\n", log,
             FormatBytes(static_cast<int64_t>(survey.file_size)), survey.events);
  if (survey.info_problem.empty()) {
    PrintRun(survey);
  } else {
    fmt::print("run       not known: {}\n", ForTerminal(survey.info_problem));
  }
  fmt::print("\n{:<30} {:<18} {:>9} {:>9} {:>10}\n", "channel", "type", "messages", "per s",
             "data");
  const double duration = survey.duration(survey.end_tick - survey.first_tick);
  for (const logging::ChannelSurvey& channel : survey.channels) PrintRow(channel, duration);
  for (const logging::ChannelSurvey& channel : survey.others) PrintRow(channel, duration);
  const size_t problems = survey.Problems(1).size();
  if (problems > 0) fmt::print("\nnot whole: see poise log check\n");
  return kExitOk;
}

struct LogCheckOptions : LogOptions {
  bool all = false;
};

int CheckLog(const LogCheckOptions& options) {
  const std::string log = FindEndedLog(options.run).string();
  const logging::LogSurvey survey = logging::SurveyLog(log);
  std::vector<std::string> problems = survey.Problems(options.all ? 0 : kPlaces);
  const auto altered = logging::CheckSums(log);
  if (altered) problems.insert(problems.end(), altered->begin(), altered->end());
  for (const std::string& problem : problems) fmt::print("{}\n", problem);
  int64_t messages = 0;
  for (const logging::ChannelSurvey& channel : survey.channels) messages += channel.ticks.messages;
  fmt::print("{}: {} events; {} messages of {} channels, ticks {} to {}: {}\n", log, survey.events,
             messages, survey.channels.size(), survey.first_tick, survey.end_tick - 1,
             !problems.empty() ? "NOT WHOLE"
             : altered         ? "whole, and as it was written"
                               : "whole; contents not checked (no check sums are beside it)");
  if (!problems.empty() && survey.spec.realtime()) {
    fmt::print(
        "The run was in real time: a component sends nothing for ticks that reach it too late. "
        "Such ticks are missing above, and are no defect of the log.\n");
  }
  return problems.empty() ? kExitOk : kExitFailed;
}

struct CutOptions : LogOptions {
  std::string out;
  bool force = false;
  std::optional<double> from;
  std::optional<double> to;
  std::optional<int64_t> first_tick;
  std::optional<int64_t> last_tick;
  std::vector<std::string> channels;
};

int Cut(const CutOptions& options) {
  if (options.from && options.to && *options.from > *options.to) {
    throw ConfigError(
        fmt::format("log cut: --from {} is after --to {}", *options.from, *options.to));
  }
  if (options.first_tick && options.last_tick && *options.first_tick > *options.last_tick) {
    throw ConfigError(fmt::format("log cut: --first-tick {} is after --last-tick {}",
                                  *options.first_tick, *options.last_tick));
  }
  const std::string log = FindLog(options.run).string();
  WarnOfRunInfo(log);
  logging::CutRange range;
  if (options.from || options.to) {
    logging::LogReader reader(log);
    range = logging::TicksOfTimes(options.from.value_or(-1e9), options.to.value_or(1e9),
                                  logging::FindRunInfo(&reader, log).spec);
  }
  if (options.first_tick) range.first_tick = *options.first_tick;
  if (options.last_tick) range.last_tick = *options.last_tick;
  range.channels = options.channels;
  CheckFileFree("--out", options.out, options.force);
  if (std::error_code error; options.force && fs::is_regular_file(options.out, error)) {
    if (fs::equivalent(options.out, log, error)) {
      throw ConfigError(fmt::format("{}: is the log itself; choose another file", options.out));
    }
    fs::remove(options.out);
  }
  const logging::CutResult result = logging::CutLog(log, range, options.out);
  if (result.refused > 0) {
    fmt::print(stderr,
               "poise: {}: {} events could not be read and are left out; see poise log "
               "check\n",
               log, result.refused);
  }
  fmt::print("{}: ticks {} to {}, {} events\n", options.out, result.first_tick, result.last_tick,
             result.events);
  return result.refused > 0 ? kExitFailed : kExitOk;
}

struct ExportOptions : LogOptions {
  bool force = false;
  std::string csv;
  std::string merged;
  std::string mcap;
};

/// Says what was written; true when nothing was left out.
bool PrintExport(const std::string& to, const std::vector<logging::ExportedChannel>& channels) {
  int64_t messages = 0;
  int64_t refused = 0;
  for (const logging::ExportedChannel& channel : channels) {
    messages += channel.messages;
    refused += channel.refused;
    if (channel.refused == 0) continue;
    fmt::print(stderr, "poise: {}: {} messages could not be read and are left out\n",
               ForTerminal(channel.channel), channel.refused);
  }
  fmt::print("{}: {} messages of {} channels\n", to, messages, channels.size());
  return refused == 0;
}

/// Throws ConfigError where one of the files would take another's place.
void CheckExportFiles(const ExportOptions& options, const std::string& log) {
  std::error_code error;
  for (const std::string& file : {options.merged, options.mcap}) {
    if (fs::equivalent(file, log, error)) {
      throw ConfigError(fmt::format("{}: is the log itself; choose another file", file));
    }
  }
  const auto whole = [](const std::string& file) {
    return fs::weakly_canonical(fs::absolute(file));
  };
  if (options.merged.empty()) return;
  if (!options.mcap.empty() && whole(options.merged) == whole(options.mcap)) {
    throw ConfigError(
        fmt::format("log export: --merged and --mcap name the same file {}", options.mcap));
  }
  if (!options.csv.empty() && whole(options.merged).parent_path() == whole(options.csv + "/.")) {
    throw ConfigError(fmt::format(
        "log export: --merged {} lies in the folder of --csv, where each file is a channel",
        options.merged));
  }
}

int Export(const ExportOptions& options) {
  if (options.csv.empty() && options.merged.empty() && options.mcap.empty()) {
    throw ConfigError("log export: nothing to write; give --csv, --merged or --mcap");
  }
  const std::string log = FindLog(options.run).string();
  CheckExportFiles(options, log);
  if (!options.csv.empty()) CheckFolderFree("--csv", options.csv, options.force);
  if (!options.merged.empty()) CheckFileFree("--merged", options.merged, options.force);
  if (!options.mcap.empty()) CheckFileFree("--mcap", options.mcap, options.force);
  WarnOfRunInfo(log);
  bool whole = true;
  if (!options.csv.empty()) {
    whole = PrintExport(options.csv, logging::ExportCsv(log, options.csv)) && whole;
  }
  if (!options.merged.empty()) {
    whole = PrintExport(options.merged, logging::ExportMergedCsv(log, options.merged)) && whole;
  }
  if (!options.mcap.empty()) {
    const std::unique_ptr<logging::McapTopics> scene = McapScene(log);
    whole = PrintExport(options.mcap, logging::ExportMcap(log, options.mcap, scene.get())) && whole;
  }
  return whole ? kExitOk : kExitFailed;
}

struct PackOptions : LogOptions {
  bool keep = false;
};

/// run.packed in a run's folder, and beside any other log.
fs::path PackedName(const fs::path& log) { return fs::path(log).replace_extension(".packed"); }

int Pack(const PackOptions& options) {
  const fs::path log = FindEndedLog(options.run);
  logging::LogReader reader(log.string());
  const RunSpec spec = logging::FindRunInfo(&reader, log.string()).spec;
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    if (const std::string why = WhyNotReplayed(spec, i); !why.empty()) {
      throw logging::LogError(
          fmt::format("{}: cannot be made again, and is not packed: {}: {}", log.string(),
                      ForTerminal(spec.graph().component(i).name()), ForTerminal(why)));
    }
  }
  const fs::path packed = PackedName(log);
  CatchStopSignals();
  StatusLine line(/*quiet=*/false);
  const logging::PackResult result =
      logging::PackLog(log.string(), packed.string(), Components(), ShowRemake(log, &line));
  line.Clear();
  if (!options.keep) fs::remove(log);
  fmt::print(
      "{}: {} in place of {}: this build has made all {} ticks again, bit for bit, and makes them "
      "when they are asked for\n",
      packed.string(), FormatBytes(static_cast<int64_t>(result.packed_bytes)),
      FormatBytes(static_cast<int64_t>(result.bytes)), result.ticks);
  return kExitOk;
}

int Unpack(const LogOptions& options) {
  // FindLog makes a packed log again.
  fmt::print("{}\n", FindLog(options.run).string());
  return kExitOk;
}

/// AddCommand of one that takes a log, with an example of its use.
template <class Options, class Run>
std::pair<CLI::App*, Options*> AddOfLog(CLI::App* log, Command* command, const std::string& name,
                                        const std::string& description, Run run,
                                        const std::string& example) {
  const auto [app, options] = AddCommand<Options>(log, command, name, description, run);
  app->add_option("run", options->run, "folder of a run or a log; default: the latest run");
  SetExample(app, fmt::format("poise log {} runs/latest{}", name, example));
  return {app, options};
}

}  // namespace

void AddLogCommand(CLI::App* app, Command* command) {
  CLI::App* const log = AddGroup(app, "log", "inspect, check, cut, export and pack a run's log");
  AddOfLog<LogOptions>(log, command, "info", "what run it is of, and its channels", Info, "");

  const auto [check, check_options] = AddOfLog<LogCheckOptions>(
      log, command, "check",
      "whether it is whole: damage by byte, missing, double, disordered and refused messages by "
      "channel and tick (exit code 1 when anything is wrong)",
      CheckLog, " --all");
  check->add_flag("--all", check_options->all,
                  fmt::format("name every place, not only the first {} of a kind", kPlaces));

  const auto [cut, cut_options] = AddOfLog<CutOptions>(
      log, command, "cut",
      "copy a part into a new log, which keeps RUN_INFO and is a run's log like the whole", Cut,
      " --from 1 --to 1.2 --out part.lcm");
  const auto time = Within("a time of -1e9 to 1e9 s", [](double s) { return std::abs(s) <= 1e9; });
  cut->add_option("--out", cut_options->out, "log to write")->required();
  cut->add_flag("--force", cut_options->force, "replace a file of that name");
  CLI::Option* from =
      cut->add_option("--from", cut_options->from, "first time, s of the scenario")->check(time);
  CLI::Option* to = cut->add_option("--to", cut_options->to, "last time, s")->check(time);
  const CLI::Range ticks(int64_t{0}, INT64_MAX - 1);
  cut->add_option("--first-tick", cut_options->first_tick, "first tick")
      ->check(ticks)
      ->excludes(from);
  cut->add_option("--last-tick", cut_options->last_tick, "last tick")->check(ticks)->excludes(to);
  AddList(cut, "--channel", &cut_options->channels,
          "channel to keep, e.g. --channel ROBOT_STATE --channel HEALTH_SIM; default: "
          "all");

  const auto [to_files, export_options] = AddOfLog<ExportOptions>(
      log, command, "export",
      "write it as CSV (PlotJuggler, spreadsheets) or MCAP (Foxglove, PlotJuggler)", Export,
      " --csv csv --mcap run.mcap");
  to_files->add_option("--csv", export_options->csv,
                       "folder for one CSV file a channel, a row a message");
  to_files->add_option("--merged", export_options->merged, "one wide CSV file, a row a tick");
  to_files->add_option("--mcap", export_options->mcap,
                       "MCAP file: the messages as Protobuf, and what shows the robot in Foxglove");
  to_files->add_flag("--force", export_options->force, "replace files of these names");

  const auto [pack, pack_options] = AddOfLog<PackOptions>(
      log, command, "pack",
      "put a small file in the place of a log that this build makes again, byte for byte: a run in "
      "lockstep without an operator's messages. It is made again first, to see that it is so",
      Pack, "");
  pack->add_flag("--keep", pack_options->keep, "leave the log");
  AddOfLog<LogOptions>(log, command, "unpack",
                       "make a packed log again; every command that reads a run's log does so too",
                       Unpack, "");
}

}  // namespace poise
