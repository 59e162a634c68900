#include "logging/log_cut.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "components/framework/configuration/suggest.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/event_log_writer.h"
#include "logging/log_survey.h"
#include "logging/partial_file.h"
#include "logging/run_record.h"

namespace poise::logging {
namespace {

/// The cut that `range` asks for, inside what the log holds.
LogCut MakeCut(const LogSurvey& survey, const CutRange& range, const std::string& path) {
  std::set<std::string> names;
  for (const ChannelSurvey& channel : survey.channels) names.insert(channel.ticks.name);
  for (const ChannelSurvey& channel : survey.others) names.insert(channel.ticks.name);
  LogCut cut;
  for (const std::string& name : range.channels) {
    if (!names.contains(name)) {
      throw LogError(fmt::format("{}: no channel named '{}'; {}", path, name,
                                 Suggest(name, {names.begin(), names.end()})));
    }
  }
  for (const std::string& name : names) {
    const auto& wanted = range.channels;
    const bool all = wanted.empty();
    if (all && survey.spec.cut().channel().empty()) break;
    if (all || std::find(wanted.begin(), wanted.end(), name) != wanted.end()) cut.add_channel(name);
  }
  cut.set_first_tick(std::max(range.first_tick, survey.first_tick));
  cut.set_last_tick(std::min(range.last_tick, survey.end_tick - 1));
  if (cut.last_tick() < cut.first_tick()) {
    throw LogError(fmt::format("{}: holds ticks {} to {}, none of those asked for", path,
                               survey.first_tick, survey.end_tick - 1));
  }
  return cut;
}

}  // namespace

CutRange TicksOfTimes(double from, double to, const RunSpec& spec) {
  // Times of ticks are rounded to a whole microsecond in the log.
  constexpr double kHalf = 0.5e-6;
  const auto tick = [&](double value) {
    const double run_tick = value + static_cast<double>(spec.lead_ticks());
    return static_cast<int64_t>(std::clamp(run_tick, -1.0, 9e15));
  };
  return {std::max<int64_t>(0, tick(std::ceil((from - kHalf) / spec.tick_period()))),
          tick(std::floor((to + kHalf) / spec.tick_period())),
          {}};
}

CutResult CutLog(const std::string& from, const CutRange& range, const std::string& to) {
  const LogSurvey survey = SurveyLog(from);
  if (!survey.info_problem.empty()) throw LogError(survey.info_problem);
  RunSpec spec = survey.spec;
  *spec.mutable_cut() = MakeCut(survey, range, from);
  // No log that someone reads is truncated, this one least of all.
  if (std::filesystem::exists(to)) {
    throw LogError(fmt::format("{}: exists; choose another name or remove it", to));
  }
  run_info_t info = survey.info;
  google::protobuf::TextFormat::PrintToString(spec, &info.run_spec);

  LogReader reader(from);
  PartialFile file(to);
  EventLogWriter writer(file.part());
  writer.Write(kRunInfoChannel, 0, MessageBytes(info));
  CutResult result{0, spec.cut().first_tick(), spec.cut().last_tick(), 0};
  const int64_t first_utime = MakeTick(result.first_tick, spec.tick_period()).utime;
  const int64_t last_utime = MakeTick(result.last_tick, spec.tick_period()).utime;
  // Nothing is cut off of what came before the first tick of all or after the last.
  const bool from_start = range.first_tick <= survey.first_tick;
  const bool to_end = range.last_tick >= survey.end_tick - 1;
  const auto in_time = [&](int64_t utime) {
    return (from_start || utime >= first_utime) && (to_end || utime <= last_utime);
  };
  std::map<std::string, bool, std::less<>> external;
  for (const Channel& channel : spec.graph().channel()) {
    external[channel.name()] = channel.external();
  }
  LogEvent event;
  while (reader.Next(&event)) {
    if (event.channel == kRunInfoChannel || !IsKept(spec, std::string(event.channel))) continue;
    const MessageType* const type = WholeMessageType(event);
    if (type == nullptr) {
      result.refused += in_time(event.utime) ? 1 : 0;
      continue;
    }
    if (type->fingerprint == run_info_t::getHash()) continue;  // under a damaged name
    const auto channel = external.find(event.channel);
    const int64_t tick = ReadInt64(event.data.data() + type->run_id_offset + 8);
    const bool after_start = tick >= result.first_tick;
    const bool before_end = tick <= result.last_tick;
    const bool inside = channel == external.end()
                            ? (from_start || after_start) && (to_end || before_end)
                        : channel->second ? in_time(event.utime)
                                          : after_start && before_end;
    if (inside) writer.Write(event.channel, event.utime, event.data);
  }
  writer.Close();
  file.Keep();
  result.events = writer.events();
  return result;
}

}  // namespace poise::logging
