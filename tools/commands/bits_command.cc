#include <gnu/libc-version.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "components/framework/build_info.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "logging/log_reader.h"
#include "logging/replay/bits.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/signals.h"
#include "tools/cli/temporary_dir.h"
#include "tools/commands/commands.h"
#include "tools/run/scenario_run.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using logging::ChannelBits;
using nlohmann::ordered_json;

/// The bits differ, made by another compiler, library or instruction set than the record's.
constexpr int kExitOtherBuild = 3;

struct BitsArguments {
  std::vector<std::string> names;
  bool processes = false;
  bool hosted = false;
  double drop_rate = 0;
  bool record = false;
};

fs::path RecordFile() { return DeployDir() / "bits/record.json"; }
fs::path BytesFile(const std::string& name) { return DeployDir() / "bits" / (name + ".bytes"); }

ordered_json ReadRecord() {
  try {
    return ordered_json::parse(ReadFile(RecordFile().string()));
  } catch (const nlohmann::json::exception& error) {
    throw ConfigError(fmt::format("{}: {}", RecordFile().string(), error.what()));
  }
}

/// What the bits depend on, by name.
ordered_json BuildVersions(const RunSpec& spec) {
  ordered_json versions = {{"instruction set", InstructionSet()}};
  for (const std::string& each : spec.library_version()) {
    const size_t space = each.find(' ');
    versions[each.substr(0, space)] = each.substr(space + 1);
  }
  versions["glibc"] = gnu_get_libc_version();
  return versions;
}

std::string VersionsText(const ordered_json& versions) {
  std::string text;
  for (const auto& [name, version] : versions.items()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, version.get<std::string>());
  }
  return text;
}

/// Runs what an entry of the record says. Throws when it does not reach its end.
std::vector<ChannelBits> RunEntry(const ordered_json& entry, const BitsArguments& arguments,
                                  ordered_json* versions) {
  RunOptions options;
  options.quiet = true;
  options.changes.reference = false;
  options.changes.drop_rate = arguments.drop_rate;
  options.changes.hosted = arguments.hosted;
  options.changes.drives = entry.value("drives", "");
  options.changes.set = entry.value("set", std::vector<std::string>());
  if (entry.contains("duration")) options.changes.duration = entry["duration"].get<double>();
  options.in_process = !arguments.processes && !arguments.hosted && arguments.drop_rate == 0 &&
                       options.changes.drives.empty();
  const TemporaryDir dir("poise-bits");
  ScenarioRun run(entry.at("scenario").get<std::string>(), options);
  *versions = BuildVersions(run.spec());
  const RunOutcome outcome = run.RunOnly(dir.path() / "run");
  if (!outcome.completed) throw std::runtime_error(outcome.message);
  return logging::BitsOfLog(dir.path() / "run/run.lcm");
}

int Bits(const BitsArguments& arguments) {
  ordered_json record = ReadRecord();
  std::vector<std::string> known;
  for (const ordered_json& entry : record.at("runs")) known.push_back(entry.at("name"));
  for (const std::string& name : arguments.names) {
    if (!IsAmong(name, known)) {
      throw ConfigError(fmt::format("there is no record of '{}'; {}", name, Suggest(name, known)));
    }
  }
  CatchStopSignals();
  int differing = 0;
  ordered_json versions;
  for (ordered_json& entry : record.at("runs")) {
    const auto name = entry.at("name").get<std::string>();
    const std::vector<std::string>& wanted = arguments.names;
    if (!wanted.empty() && !IsAmong(name, wanted)) continue;
    fmt::print("{}: ", name);
    std::fflush(stdout);
    const std::vector<ChannelBits> seen = RunEntry(entry, arguments, &versions);
    if (StopSignal() != 0) return kExitFailed;
    if (arguments.record) {
      entry["channels"] = logging::BitsJson(seen);
      WriteFile(BytesFile(name), logging::BitsBytes(seen));
      fmt::print("recorded\n");
      continue;
    }
    const auto recorded = logging::ParseBits(entry.value("channels", ordered_json::array()),
                                             ReadFile(BytesFile(name).string()));
    const auto difference = logging::FirstDifference(recorded, seen);
    size_t messages = 0;
    for (const ChannelBits& channel : seen) messages += channel.by_tick.size();
    if (!difference) {
      fmt::print("the same bits in {} messages of {} channels\n", messages, seen.size());
    } else {
      ++differing;
      fmt::print("OTHER BITS: first at tick {}, {}: {}\n", difference->tick, difference->channel,
                 difference->what);
    }
    std::fflush(stdout);
  }
  if (arguments.record) {
    record["versions"] = versions;
    WriteFile(RecordFile(), record.dump(1) + "\n");
    fmt::print("{}: the record of {}\n", RecordFile().string(), VersionsText(versions));
    return kExitOk;
  }
  fmt::print("recorded with {}\n", VersionsText(record["versions"]));
  if (versions != record["versions"]) {
    fmt::print("this build:   {}{}\n", VersionsText(versions),
               differing == 0 ? "" : "; another build may give other bits");
  }
  if (differing == 0) return kExitOk;
  return versions == record["versions"] ? kExitFailed : kExitOtherBuild;
}

}  // namespace

void AddBitsCommand(CLI::App* app, Command* command) {
  const auto [bits, arguments] = AddCommand<BitsArguments>(
      app, command, "bits",
      "run what deploy/bits has a record of and compare every message, bit for bit", Bits);
  bits->add_option("run", arguments->names, "of the record; default: all");
  bits->add_flag("--processes", arguments->processes, "as processes; default: in one process");
  bits->add_flag("--hosted", arguments->hosted,
                 "as processes, of which one runs the whole controller");
  bits->add_option("--drop", arguments->drop_rate,
                   "as processes, each of which drops this share of its messages")
      ->check(Within("in [0, 0.9]", [](double share) { return share >= 0 && share <= 0.9; }));
  bits->add_flag("--record", arguments->record,
                 "record this build's bits anew; say in the commit why they changed");
  bits->footer(
      "Exit code: 0 the same bits; 1 other bits; 3 other bits, and this build has another "
      "instruction set, compiler or library than the record's.\nExample: "
      "poise bits push_double_support");
}

}  // namespace poise
