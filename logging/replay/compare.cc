#include "logging/replay/compare.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "components/framework/bus/packet_filter.h"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "logging/replay/message_difference.h"
#include "logging/run_info.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

/// The messages of both logs by tick and channel index, as long as their readers live; empty: there
/// is none.
using MessagePairs = std::map<std::pair<int64_t, int>, std::array<std::span<const uint8_t>, 2>>;

/// Adds those of `log`, 0 or 1, and returns its run.
RunSpec Collect(LogReader* reader, const std::string& path, size_t log, MessagePairs* to) {
  RunSpec spec = FindRunInfo(reader, path).spec;
  std::map<std::string, int, std::less<>> index;
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const Channel& channel = spec.graph().channel(i);
    if (!channel.external()) index[channel.name()] = i;
  }
  LogEvent event;
  while (reader->Next(&event)) {
    const auto channel = index.find(event.channel);
    if (channel == index.end()) continue;
    const MessageType& type = ChannelType(spec.graph().channel(channel->second));
    if (event.data.size() < static_cast<size_t>(type.run_id_offset) + 24) continue;
    const int64_t tick = ReadInt64(event.data.data() + type.run_id_offset + 8);
    std::span<const uint8_t>& place = (*to)[{tick, channel->second}][log];
    if (place.empty()) place = event.data;
  }
  return spec;
}

void DescribeField(const MessageType& type, std::span<const uint8_t> a, std::span<const uint8_t> b,
                   LogDifference* difference) {
  const auto scalars = DifferingScalars(type, a, b);
  if (!scalars) {
    difference->field = "(not decodable, or other numbers of elements)";
  } else if (!scalars->empty()) {
    difference->field = scalars->front().path;
    difference->first = scalars->front().first;
    difference->second = scalars->front().second;
  }
}

}  // namespace

LogComparison CompareLogs(const std::string& first, const std::string& second) {
  MessagePairs messages;
  LogReader reader_a(first);
  const RunSpec a = Collect(&reader_a, first, 0, &messages);
  LogReader reader_b(second);
  const RunSpec b = Collect(&reader_b, second, 1, &messages);
  const auto same = [](const Channel& x, const Channel& y) {
    return x.name() == y.name() && x.type() == y.type();
  };
  if (!std::ranges::equal(a.graph().channel(), b.graph().channel(), same)) {
    throw LogError(fmt::format("{} and {}: their graphs have different channels", first, second));
  }

  LogComparison result;
  int64_t last_tick = -1;
  for (const auto& [at, of] : messages) {
    const auto& [tick, index] = at;
    const Channel& channel = a.graph().channel(index);
    LogDifference difference{tick, channel.name(), {}, {}, {}};
    if (of[0].empty() || of[1].empty()) {
      const bool only_first = of[1].empty();
      ++(only_first ? result.only_first : result.only_second);
      difference.first = only_first ? "present" : "absent";
      difference.second = only_first ? "absent" : "present";
    } else {
      ++result.messages;
      result.ticks += tick != last_tick ? 1 : 0;
      last_tick = tick;
      if (SameBits(ChannelType(channel), of[0], of[1])) continue;
      ++result.differing;
      if (!result.earliest) DescribeField(ChannelType(channel), of[0], of[1], &difference);
    }
    if (!result.earliest) result.earliest = std::move(difference);
  }
  return result;
}

}  // namespace poise::logging
