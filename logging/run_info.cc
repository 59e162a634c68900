#include "logging/run_info.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "logging/run_log_writer.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

namespace fs = std::filesystem;

constexpr int kLooks = 1000;  // messages that tell which run a log is of

/// run_ids of the log's first messages.
std::set<int64_t> RunIds(LogReader* reader) {
  std::set<int64_t> ids;
  LogEvent event;
  for (int i = 0; i < kLooks && reader->Next(&event); ++i) {
    const MessageType* const type = WholeMessageType(event);
    if (type == nullptr || event.channel == kRunInfoChannel) continue;
    ids.insert(ReadInt64(event.data.data() + type->run_id_offset));
  }
  reader->Rewind();
  return ids;
}

/// The files beside the log. Throws ConfigError or LogError: why they cannot be used.
RunInfo ReadFolder(LogReader* reader, const fs::path& folder) {
  const std::string file = (folder / "run_spec.pbtxt").string();
  RunInfo result;
  ReadTextProto(file, &result.spec);
  CheckLogSpec(result.spec, file);
  const std::set<int64_t> ids = RunIds(reader);
  if (!ids.empty() && !ids.contains(result.spec.run_id())) {
    throw LogError(fmt::format("{}: is of run {}, the log's messages are of run {}", file,
                               result.spec.run_id(), *ids.begin()));
  }
  const fs::path scenario = folder / "scenario.pbtxt";
  result.info = MakeRunInfo(result.spec, fs::exists(scenario) ? ReadFile(scenario.string()) : "");
  result.info.started_at.clear();  // of the run, not of this moment
  return result;
}

}  // namespace

run_info_t ReadRunInfo(LogReader* reader, const std::string& path, RunSpec* spec) {
  LogEvent event;
  run_info_t info;
  if (!reader->Next(&event) || event.channel != kRunInfoChannel ||
      !DecodeChecked(event.data, &info)) {
    throw LogError(fmt::format(
        "{}: does not begin with RUN_INFO; is it the log of a Poise run, and whole?", path));
  }
  try {
    ParseTextProto(info.run_spec, path + ": RUN_INFO.run_spec", spec);
  } catch (const ConfigError& error) {
    throw LogError(error.what());
  }
  return info;
}

RunInfo FindRunInfo(LogReader* reader, const std::string& path) {
  RunInfo result;
  std::string problem;
  try {
    result.info = ReadRunInfo(reader, path, &result.spec);
    CheckLogSpec(result.spec, path);
    return result;
  } catch (const LogError& error) {
    problem = error.what();
  }
  reader->Rewind();
  try {
    const fs::path folder = fs::absolute(path).parent_path();
    result = ReadFolder(reader, folder);
    result.warning =
        fmt::format("{}; the run is taken from run_spec.pbtxt beside the log", problem);
    return result;
  } catch (const std::exception& error) {
    // What a module would know, the files beside the log do not tell.
    const bool read = !result.info.run_spec.empty();
    const auto unknown = [](const Channel& channel) {
      return FindMessageType(channel.type()) == nullptr;
    };
    if (read && std::ranges::any_of(result.spec.graph().channel(), unknown)) {
      throw LogError(problem);
    }
    throw LogError(fmt::format(
        "{}; nor is the run's folder beside it ({}): put the run's run_spec.pbtxt and "
        "scenario.pbtxt beside the log, or take its messages alone with poise log export",
        problem, error.what()));
  }
}

std::string RunInfoWarning(const std::string& path) {
  try {
    LogReader reader(path);
    return FindRunInfo(&reader, path).warning;
  } catch (const LogError&) {
    return "";  // told by whoever needs it
  }
}

}  // namespace poise::logging
