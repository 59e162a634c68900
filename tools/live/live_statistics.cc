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
    : spec_(spec), interval_begin_(now) {
  for (const Channel& channel : spec.graph().channel()) {
    ChannelCount& count = channels_.emplace_back();
    count.row.name = channel.name();
    count.row.type = channel.type();
    count.external = channel.external();
  }
}

void LiveStatistics::AddMessage(int channel, int64_t tick, size_t bytes, int64_t now) {
  ChannelCount& count = channels_[static_cast<size_t>(channel)];
  LiveSnapshot::ChannelRow& row = count.row;
  if (!count.external) {
    if (row.tick >= 0 && tick > row.tick) row.missed += tick - row.tick - 1;
    if (tick > newest_.tick) newest_ = {tick, now};
    if (first_.tick < 0) first_ = newest_;
  }
  row.tick = std::max(row.tick, tick);
  ++count.messages;
  row.bytes_per_message = static_cast<int64_t>(bytes);
  count.bytes += row.bytes_per_message;
  count.last_arrival = now;
}

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
  for (ChannelCount& count : channels_) {
    LiveSnapshot::ChannelRow& row = snapshot.channels.emplace_back(count.row);
    row.rate = static_cast<double>(count.messages) / interval;
    row.bytes_per_second = static_cast<double>(count.bytes) / interval;
    row.age = row.bytes_per_message == 0 ? -1 : Seconds(now - count.last_arrival);
    count.messages = 0;
    count.bytes = 0;
  }
  interval_begin_ = now;
  return snapshot;
}

}  // namespace poise
