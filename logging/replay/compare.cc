#include "logging/replay/compare.h"

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

/// Messages by tick and channel index; the spans live as long as the reader.
struct MessagesByTick {
  LogReader reader;
  RunSpec spec;
  std::map<std::pair<int64_t, int>, std::span<const uint8_t>> by_tick;

  explicit MessagesByTick(const std::string& path) : reader(path) {
    spec = FindRunInfo(&reader, path).spec;
    std::map<std::string, int, std::less<>> index;
    for (int i = 0; i < spec.graph().channel_size(); ++i) {
      const Channel& channel = spec.graph().channel(i);
      if (!channel.external()) index[channel.name()] = i;
    }
    LogEvent event;
    while (reader.Next(&event)) {
      const auto channel = index.find(event.channel);
      if (channel == index.end()) continue;
      const MessageType* type = FindMessageType(spec.graph().channel(channel->second).type());
      const auto header_end = static_cast<size_t>(type->run_id_offset) + 24;
      if (event.data.size() < header_end) continue;
      const int64_t tick = ReadInt64(event.data.data() + type->run_id_offset + 8);
      by_tick.try_emplace({tick, channel->second}, event.data);
    }
  }
};

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
  const MessagesByTick a(first);
  const MessagesByTick b(second);
  const auto& graph = a.spec.graph();
  bool same_channels = graph.channel_size() == b.spec.graph().channel_size();
  for (int i = 0; same_channels && i < graph.channel_size(); ++i) {
    same_channels = graph.channel(i).name() == b.spec.graph().channel(i).name() &&
                    graph.channel(i).type() == b.spec.graph().channel(i).type();
  }
  if (!same_channels) {
    throw LogError(fmt::format("{} and {}: their graphs have different channels", first, second));
  }

  LogComparison result;
  const auto note = [&](LogDifference difference) {
    if (!result.earliest) result.earliest = std::move(difference);
  };
  auto i = a.by_tick.begin();
  auto j = b.by_tick.begin();
  int64_t last_tick = -1;
  while (i != a.by_tick.end() || j != b.by_tick.end()) {
    const bool take_a = j == b.by_tick.end() || (i != a.by_tick.end() && i->first <= j->first);
    const bool take_b = i == a.by_tick.end() || (j != b.by_tick.end() && j->first <= i->first);
    const auto [tick, index] = take_a ? i->first : j->first;
    const Channel& channel = graph.channel(index);
    if (take_a && take_b) {
      ++result.messages;
      result.ticks += tick != last_tick ? 1 : 0;
      last_tick = tick;
      const MessageType& type = *FindMessageType(channel.type());
      if (!SameBits(type, i->second, j->second)) {
        ++result.differing;
        if (!result.earliest) {
          LogDifference difference{tick, channel.name(), {}, {}, {}};
          DescribeField(type, i->second, j->second, &difference);
          note(std::move(difference));
        }
      }
    } else if (take_a) {
      ++result.only_first;
      note({tick, channel.name(), "", "present", "absent"});
    } else {
      ++result.only_second;
      note({tick, channel.name(), "", "absent", "present"});
    }
    if (take_a) ++i;
    if (take_b) ++j;
  }
  return result;
}

}  // namespace poise::logging
