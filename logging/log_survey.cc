#include "logging/log_survey.h"

#include <algorithm>

#include "fmt/format.h"
#include "lcmtypes/message_scalars.h"
#include "logging/printable.h"
#include "logging/run_record.h"

namespace poise::logging {
namespace {

/// Sorts a log's events to their channels.
class Surveyor {
 public:
  explicit Surveyor(const std::string& path) : reader_(path) {
    try {
      RunInfo run = FindRunInfo(&reader_, path);
      survey_.info = std::move(run.info);
      survey_.spec = std::move(run.spec);
      survey_.info_warning = std::move(run.warning);
    } catch (const LogError& error) {
      survey_.info_problem = error.what();
    }
    survey_.first_tick = survey_.spec.cut().first_tick();
    for (const Channel& channel : survey_.spec.graph().channel()) {
      if (!IsKept(survey_.spec, channel.name())) continue;
      index_[channel.name()] = lanes_.size();
      lanes_.push_back({ChannelTicks(survey_.spec, channel, reader_.file_size()), &channel});
      survey_.channels.push_back({channel.type(), channel.external(), {channel.name()}, {}, {}});
    }
  }

  LogSurvey Run(const std::string& path) {
    LogReader all(path);  // RUN_INFO too, however damaged
    std::optional<Neighbour> before;
    LogEvent event;
    while (true) {
      const int64_t damages = all.damages();
      const bool more = all.Next(&event);
      std::optional<Neighbour> now;
      if (more) {
        ++survey_.events;
        now = {std::string(event.channel), Add(event)};
      }
      if (all.damages() > damages) survey_.damage.push_back({all.damage().back(), before, now});
      if (!more) break;
      before = now;
    }
    survey_.file_size = all.file_size();
    for (const Lane& lane : lanes_) {
      survey_.end_tick = std::max(survey_.end_tick, lane.ticks.newest() + 1);
    }
    for (size_t i = 0; i < lanes_.size(); ++i) {
      ChannelSurvey& channel = survey_.channels[i];
      if (channel.external) continue;
      channel.ticks = lanes_[i].ticks.Completeness(survey_.first_tick, survey_.end_tick);
      channel.missing = lanes_[i].ticks.Missing(survey_.first_tick, survey_.end_tick);
    }
    for (auto& [name, other] : others_) survey_.others.push_back(std::move(other));
    return std::move(survey_);
  }

 private:
  struct Lane {
    ChannelTicks ticks;
    const Channel* channel;
  };

  /// The event's tick, where it has one.
  std::optional<int64_t> Add(const LogEvent& event) {
    const auto found = index_.find(event.channel);
    return found == index_.end() ? AddOther(event) : AddToChannel(event, found->second);
  }

  std::optional<int64_t> AddToChannel(const LogEvent& event, size_t index) {
    ChannelTicks& ticks = lanes_[index].ticks;
    ChannelSurvey& channel = survey_.channels[index];
    const MessageType& type = ChannelType(*lanes_[index].channel);
    channel.bytes += static_cast<int64_t>(event.data.size());
    if (channel.external) {
      const bool good = AllFinite(type, event.data) &&
                        ReadInt64(event.data.data() + type.run_id_offset) == survey_.spec.run_id();
      ++(good ? channel.ticks.messages : channel.ticks.refused);
      if (!good) channel.refused_at.push_back(event.offset);
      return {};
    }
    const int64_t refused = ticks.refused();
    const std::optional<int64_t> tick = ticks.Check(event.data);
    if (tick && AllFinite(type, event.data)) {
      ticks.Take(*tick);
    } else if (tick) {
      ticks.Refuse();
    }
    if (ticks.refused() > refused) channel.refused_at.push_back(event.offset);
    return tick;
  }

  std::optional<int64_t> AddOther(const LogEvent& event) {
    ChannelSurvey& other = others_[std::string(event.channel)];
    other.ticks.name = event.channel;
    other.bytes += static_cast<int64_t>(event.data.size());
    const MessageType* const type = TypeByFingerprint(event);
    if (type == nullptr || !type->has_header || !AllFinite(*type, event.data)) {
      ++other.ticks.refused;
      other.refused_at.push_back(event.offset);
      return {};
    }
    ++other.ticks.messages;
    other.type = type->name;
    const int64_t tick = ReadInt64(event.data.data() + type->run_id_offset + 8);
    if (event.channel.starts_with("HEALTH_") && survey_.info_problem.empty()) {
      std::optional<health_t> health = ReadHealth(event, survey_.spec.run_id());
      if (health) {
        survey_.health[health->component] = std::move(*health);
      } else {
        --other.ticks.messages;
        ++other.ticks.refused;
        other.refused_at.push_back(event.offset);
      }
    }
    return tick;
  }

  LogReader reader_;
  LogSurvey survey_;
  std::vector<Lane> lanes_;
  std::map<std::string, size_t, std::less<>> index_;
  std::map<std::string, ChannelSurvey> others_;
};

/// "a, b and 3 more", of at most `limit` of `items`; 0: all.
std::string List(const std::vector<std::string>& items, size_t limit) {
  const size_t shown = limit == 0 ? items.size() : std::min(items.size(), limit);
  std::string list;
  for (size_t i = 0; i < shown; ++i) list += (i == 0 ? "" : ", ") + items[i];
  if (shown < items.size()) list += fmt::format(" and {} more", items.size() - shown);
  return list;
}

std::string Describe(const std::optional<Neighbour>& neighbour, const char* none) {
  if (!neighbour) return none;
  if (!neighbour->tick) return neighbour->channel;
  return fmt::format("{} of tick {}", neighbour->channel, *neighbour->tick);
}

std::string Describe(const DamageSurvey& damage) {
  const LogDamage& d = damage.damage;
  const std::optional<int64_t> lost = d.lost_events();
  const std::string events = !d.number_after ? "the last event is cut or damaged"
                             : !lost         ? "events lost"
                             : *lost == 1
                                 ? fmt::format("1 event lost, number {}", d.number_before + 1)
                             : *lost == 0 ? "no event lost"
                                          : fmt::format("{} events lost, numbers {} to {}", *lost,
                                                        d.number_before + 1, *d.number_after - 1);
  return fmt::format("damage at byte {}: {} bytes are no event ({}), between {} and {}", d.offset,
                     d.size, events, Describe(damage.before, "the file's beginning"),
                     Describe(damage.after, "the file's end"));
}

void AddChannelProblems(const ChannelSurvey& channel, size_t limit,
                        std::vector<std::string>* problems) {
  const ChannelCompleteness& ticks = channel.ticks;
  if (ticks.messages == 0 && ticks.other_type > 0 && ticks.other_type == ticks.refused) {
    problems->push_back(
        fmt::format("{}: all {} messages are of another version of their type, as a Poise of "
                    "another commit wrote them; that one reads them",
                    ticks.name, ticks.refused));
    return;
  }
  if (!channel.missing.empty()) {
    std::vector<std::string> ranges;
    for (const TickRange& range : channel.missing) {
      ranges.push_back(range.first == range.last
                           ? fmt::format("{}", range.first)
                           : fmt::format("{} to {}", range.first, range.last));
    }
    problems->push_back(fmt::format("{}: {} of its messages missing: tick {}", ticks.name,
                                    ticks.missing, List(ranges, limit)));
  }
  if (ticks.duplicate > 0) {
    problems->push_back(fmt::format("{}: {} messages of a tick that was there already", ticks.name,
                                    ticks.duplicate));
  }
  if (ticks.out_of_order > 0) {
    problems->push_back(
        fmt::format("{}: {} messages out of order", ticks.name, ticks.out_of_order));
  }
  if (ticks.refused > 0) {
    std::vector<std::string> offsets;
    for (const uint64_t offset : channel.refused_at) offsets.push_back(fmt::format("{}", offset));
    problems->push_back(
        fmt::format("{}: {} messages are not of its type, run or ticks, or not finite: at byte {}",
                    ticks.name, ticks.refused, List(offsets, limit)));
  }
}

void AddEndProblem(const LogSurvey& survey, std::vector<std::string>* problems) {
  if (!survey.info_problem.empty() || survey.spec.has_cut()) return;
  const auto ended = [](const auto& entry) {
    return entry.second.state == health_t::STATE_FINISHED ||
           entry.second.state == health_t::STATE_FAILED;
  };
  if (std::none_of(survey.health.begin(), survey.health.end(), ended)) {
    problems->push_back(fmt::format(
        "no component's end is in the log: the recording ended at tick {} of {}, before the run or "
        "with a run that was interrupted",
        survey.end_tick, survey.spec.num_ticks()));
  }
}

}  // namespace

std::vector<std::string> LogSurvey::Problems(size_t limit) const {
  std::vector<std::string> problems;
  if (!info_problem.empty()) {
    problems.push_back(info_problem + "; completeness by channel cannot be told");
  }
  if (!info_warning.empty()) problems.push_back(info_warning);
  const size_t shown = limit == 0 ? damage.size() : std::min(damage.size(), limit);
  for (size_t i = 0; i < shown; ++i) problems.push_back(Describe(damage[i]));
  if (damage.size() > shown) {
    uint64_t bytes = 0;
    for (size_t i = shown; i < damage.size(); ++i) bytes += damage[i].damage.size;
    problems.push_back(
        fmt::format("{} more damaged places, {} bytes", damage.size() - shown, bytes));
  }
  for (const ChannelSurvey& channel : channels) AddChannelProblems(channel, limit, &problems);
  for (const ChannelSurvey& channel : others) {
    AddChannelProblems(channel, limit, &problems);
    const std::string& name = channel.ticks.name;
    if (info_problem.empty() && name != kRunInfoChannel && !name.starts_with("HEALTH_")) {
      problems.push_back(fmt::format("'{}' is no channel of the run: {} messages", name,
                                     channel.ticks.messages + channel.ticks.refused));
    }
  }
  AddEndProblem(*this, &problems);
  for (std::string& problem : problems) problem = ForTerminal(problem);
  return problems;
}

LogSurvey SurveyLog(const std::string& path) { return Surveyor(path).Run(path); }

}  // namespace poise::logging
