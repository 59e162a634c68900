#include "logging/channel_ticks.h"

#include <algorithm>

#include "components/framework/graph.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/run_log_writer.h"

namespace poise::logging {
namespace {

// A tick beyond this is damage, not a run: 5 hours at 500 Hz.
constexpr int64_t kMaxTicks = 10'000'000;
constexpr int64_t kMinRecordSize = 29;  // bytes, of an event's header and a channel's name

}  // namespace

void CheckLogSpec(const RunSpec& spec, const std::string& path) {
  try {
    CheckRun(spec, path + ": RUN_INFO: ");
  } catch (const ConfigError& error) {
    throw LogError(error.what());
  }
  if (spec.has_cut() &&
      (spec.cut().first_tick() >= kMaxTicks || spec.cut().last_tick() < spec.cut().first_tick())) {
    throw LogError(fmt::format("{}: RUN_INFO: cut: ticks {} to {} are none", path,
                               spec.cut().first_tick(), spec.cut().last_tick()));
  }
  for (const Channel& channel : spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    if (type != nullptr && channel.count_size() > 0 &&
        static_cast<size_t>(channel.count_size()) != type->count_names.size()) {
      throw LogError(fmt::format(
          "{}: RUN_INFO: channel {}: its {} has {} counts, this build's has {}: the log "
          "is of another version{}, which can read it",
          path, channel.name(), channel.type(), channel.count_size(), type->count_names.size(),
          spec.has_poise_commit() ? fmt::format(" ({})", spec.poise_commit()) : ""));
    }
    if (type == nullptr || type->has_strings || type->run_id_offset < 0 ||
        static_cast<size_t>(channel.count_size()) != type->count_names.size()) {
      throw LogError(fmt::format("{}: RUN_INFO: channel {} has no known type '{}' and counts{}",
                                 path, channel.name(), channel.type(),
                                 type == nullptr ? "; " + ModulesSearched() : ""));
    }
    for (size_t i = 0; i < type->count_names.size(); ++i) {
      const int32_t count = channel.count(static_cast<int>(i));
      if (count >= 0 && count <= kMaxCount) continue;
      throw LogError(fmt::format("{}: RUN_INFO: channel {}: {} is {}; must be 0 to {}", path,
                                 channel.name(), type->count_names[i], count, kMaxCount));
    }
  }
}

const MessageType& ChannelType(const Channel& channel) { return *FindMessageType(channel.type()); }

int64_t MessageSize(const Channel& channel) {
  return ChannelType(channel).encoded_size(CountsOf(channel));
}

PacketFilter ChannelFilter(const RunSpec& spec, const Channel& channel) {
  return {ChannelType(channel).fingerprint, static_cast<int>(MessageSize(channel)),
          CountsOf(channel), spec.run_id()};
}

bool IsKept(const RunSpec& spec, const std::string& channel) {
  const auto& kept = spec.cut().channel();
  return kept.empty() || std::find(kept.begin(), kept.end(), channel) != kept.end();
}

ChannelTicks::ChannelTicks(const RunSpec& spec, const Channel& channel, uint64_t log_size)
    : filter_(ChannelFilter(spec, channel)),
      fingerprint_(ChannelType(channel).fingerprint),
      first_tick_(spec.cut().first_tick()),
      end_tick_(spec.num_ticks() > 0 ? std::min(spec.num_ticks(), kMaxTicks) : kMaxTicks) {
  const auto records = static_cast<int64_t>(log_size) / kMinRecordSize;
  end_tick_ = std::min(end_tick_, first_tick_ + records);
  completeness_.name = channel.name();
}

std::optional<int64_t> ChannelTicks::Check(std::span<const uint8_t> data) {
  if (filter_.Check(data.data(), data.size(), first_tick_, end_tick_ - 1) !=
      PacketVerdict::kAccepted) {
    ++completeness_.refused;
    const bool other = data.size() >= 8 && ReadInt64(data.data()) != fingerprint_;
    completeness_.other_type += other ? 1 : 0;
    return {};
  }
  const int64_t tick = filter_.tick(data.data());
  if (static_cast<size_t>(tick) < seen_.size() && seen_[static_cast<size_t>(tick)]) {
    ++completeness_.duplicate;
    return {};
  }
  return tick;
}

void ChannelTicks::Take(int64_t tick) {
  const auto i = static_cast<size_t>(tick);
  if (i >= seen_.size()) seen_.resize(i + 1, false);
  seen_[i] = true;
  ++completeness_.messages;
  completeness_.out_of_order += tick < newest_ ? 1 : 0;
  newest_ = std::max(newest_, tick);
}

ChannelCompleteness ChannelTicks::Completeness(int64_t first, int64_t end) const {
  ChannelCompleteness completeness = completeness_;
  for (const TickRange& range : Missing(first, end)) {
    completeness.missing += range.last - range.first + 1;
  }
  return completeness;
}

std::vector<TickRange> ChannelTicks::Missing(int64_t first, int64_t end) const {
  std::vector<TickRange> missing;
  for (int64_t tick = first; tick < end; ++tick) {
    if (static_cast<size_t>(tick) < seen_.size() && seen_[static_cast<size_t>(tick)]) continue;
    if (!missing.empty() && missing.back().last == tick - 1) {
      missing.back().last = tick;
    } else {
      missing.push_back({tick, tick});
    }
  }
  return missing;
}

}  // namespace poise::logging
