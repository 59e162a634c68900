#include "tools/live/live_statistics.h"

#include <algorithm>

#include "components/framework/run.h"
#include "tools/cli/lists.h"

namespace poise {
namespace {

double Seconds(int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

}  // namespace

double LiveStatistics::Progress::RateSince(const Progress& from) const {
  if (from.tick < 0 || time <= from.time) return -1;
  return (static_cast<double>(tick) - static_cast<double>(from.tick)) / Seconds(time - from.time);
}

LiveStatistics::LiveStatistics(const RunSpec& spec, int64_t now)
    : spec_(spec),
      channels_(static_cast<size_t>(spec.graph().channel_size())),
      interval_begin_(now) {
  for (size_t i = 0; i < channels_.size(); ++i) {
    channels_[i].external = spec.graph().channel(static_cast<int>(i)).external();
  }
}

void LiveStatistics::AddMessage(int channel, int64_t tick, size_t bytes, int64_t now) {
  ChannelCount& count = channels_[static_cast<size_t>(channel)];
  if (!count.external) {
    if (count.tick >= 0 && tick > count.tick) count.missed += tick - count.tick - 1;
    if (tick > newest_.tick) newest_ = {tick, now};
    if (first_.tick < 0) first_ = newest_;
  }
  count.tick = std::max(count.tick, tick);
  ++count.messages;
  count.last_bytes = static_cast<int64_t>(bytes);
  count.bytes += count.last_bytes;
  count.last_arrival = now;
}

void LiveStatistics::SetBus(const bus_status_t& status) { bus_ = status; }

void LiveStatistics::SetBridge(const bridge_status_t& status) { bridge_ = status; }

void LiveStatistics::SetProcess(const std::string& name, const ControlClient::Status& status) {
  if (!status.seen) return;
  ProcessCount& process = processes_[name];
  process.status = status;
  if (process.first.tick < 0) process.first = {status.health.tick, status.last_seen};
}

LiveSnapshot LiveStatistics::Take(int64_t now) {
  LiveSnapshot snapshot;
  const double interval = Seconds(std::max<int64_t>(1, now - interval_begin_));
  snapshot.tick = newest_.tick;
  snapshot.tick_rate = newest_.RateSince(first_);
  snapshot.bridge = bridge_;
  snapshot.bus = bus_;
  first_ = newest_;
  std::vector<std::string> names = NamesOf(spec_.graph().component());
  names.push_back(kRecorderName);
  for (const std::string& name : names) {
    LiveSnapshot::Process row;
    row.name = name;
    const auto found = processes_.find(name);
    if (found != processes_.end()) {
      ProcessCount& process = found->second;
      const Progress last{process.status.health.tick, process.status.last_seen};
      // An interval shorter than that of health reports keeps the last known rate.
      if (last.time > process.first.time) process.rate = last.RateSince(process.first);
      process.first = last;
      row.seen = true;
      row.health = process.status.health;
      row.tick_rate = process.rate;
      row.age = Seconds(now - process.status.last_seen);
    }
    snapshot.processes.push_back(std::move(row));
  }
  for (int i = 0; i < spec_.graph().channel_size(); ++i) {
    ChannelCount& count = channels_[static_cast<size_t>(i)];
    LiveSnapshot::ChannelRow row;
    row.name = spec_.graph().channel(i).name();
    row.type = spec_.graph().channel(i).type();
    row.tick = count.tick;
    row.rate = static_cast<double>(count.messages) / interval;
    row.bytes_per_second = static_cast<double>(count.bytes) / interval;
    row.bytes_per_message = count.last_bytes;
    row.age = count.last_bytes == 0 ? -1 : Seconds(now - count.last_arrival);
    row.missed = count.missed;
    count.messages = 0;
    count.bytes = 0;
    snapshot.channels.push_back(std::move(row));
  }
  interval_begin_ = now;
  return snapshot;
}

}  // namespace poise
