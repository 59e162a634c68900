#include "logging/replay/log_player.h"

#include <algorithm>
#include <ctime>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "logging/channel_ticks.h"
#include "logging/log_messages.h"

namespace poise::logging {
namespace {

constexpr int64_t kLongestSleep = 50'000'000;  // ns, so that a stop is soon seen

struct PlayedEvent {
  int64_t tick;
  std::string channel;
  std::span<const uint8_t> data;
};

/// Waits until `due` (ns); false: stopped.
bool WaitUntil(int64_t due, const std::function<bool()>& stop) {
  for (int64_t now = NowNanoseconds(); now < due; now = NowNanoseconds()) {
    if (stop()) return false;
    const int64_t wake = std::min(due, now + kLongestSleep);
    const timespec deadline{wake / 1'000'000'000, wake % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
  }
  return !stop();
}

}  // namespace

PlayResult PlayLog(const std::string& path, const std::string& url, double speed,
                   const std::function<bool()>& stop) {
  LogMessages messages(path);
  const RunSpec& spec = messages.spec();
  std::map<std::string, ChannelTicks, std::less<>> own_ticks;
  for (const Channel& channel : spec.graph().channel()) {
    if (!channel.external()) {
      own_ticks.emplace(channel.name(), ChannelTicks(spec, channel, messages.reader().file_size()));
    }
  }
  std::vector<PlayedEvent> events;
  LogEvent event;
  int64_t newest = spec.cut().first_tick();
  while (messages.reader().Next(&event)) {
    const MessageType* const type = messages.TypeOf(event);
    if (type == nullptr || event.channel == kRunInfoChannel) continue;
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

  BusSender bus(url);
  PlayResult result;
  if (events.empty()) return result;
  const double first = MakeTick(events.front().tick, spec.tick_period()).time;
  const int64_t start = NowNanoseconds();
  for (const PlayedEvent& e : events) {
    const double time = MakeTick(e.tick, spec.tick_period()).time - first;
    if (!WaitUntil(start + static_cast<int64_t>(time / speed * 1e9), stop)) break;
    const bool sent = bus.Send(e.channel.c_str(), e.data.data(), e.data.size());
    ++(sent ? result.messages : result.failed);
    result.time = time;
  }
  return result;
}

}  // namespace poise::logging
