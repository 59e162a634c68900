#include "logging/export/signal_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

/// Appends one message's scalars to the columns of its channel.
class ColumnAppender : public ScalarVisitor {
 public:
  explicit ColumnAppender(const MessageType* type) : type_(type) {}

  void Integer(std::string_view path, int64_t value) override {
    if (IsSignal(*type_, path)) Add(path, true, static_cast<double>(value));
  }
  void Real(std::string_view path, double value) override { Add(path, false, value); }
  void Text(std::string_view, std::string_view) override {}

  void BeginMessage() { next_ = 0; }
  std::vector<SignalColumn>& columns() { return columns_; }

 private:
  void Add(std::string_view path, bool integer, double value) {
    // The counts of a channel are the same in all its messages, and so are its fields.
    if (next_ == columns_.size()) columns_.push_back({std::string(path), integer, {}});
    columns_[next_++].values.push_back(value);
  }

  const MessageType* type_;
  std::vector<SignalColumn> columns_;
  size_t next_ = 0;
};

struct ColumnLane {
  const MessageType* type;
  std::optional<PacketFilter> filter;  ///< none: HEALTH_*, checked as it is decoded
  bool external = false;
  ColumnAppender appender;
  std::vector<int64_t> ticks;
  std::vector<bool> seen;  ///< by tick

  bool Seen(int64_t tick) const {
    const auto i = static_cast<size_t>(tick);
    return i < seen.size() && seen[i];
  }
  void Append(int64_t tick, std::span<const uint8_t> data) {
    appender.BeginMessage();
    if (!type->visit(data.data(), static_cast<int64_t>(data.size()), &appender)) return;
    ticks.push_back(tick);
    if (static_cast<size_t>(tick) >= seen.size()) seen.resize(static_cast<size_t>(tick) + 1);
    seen[static_cast<size_t>(tick)] = true;
  }
};

/// By ascending tick.
void Sort(ChannelColumns* channel) {
  if (std::ranges::is_sorted(channel->ticks)) return;
  std::vector<size_t> order(channel->ticks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return channel->ticks[i]; });
  const auto apply = [&](auto* values) {
    auto sorted = *values;
    for (size_t i = 0; i < order.size(); ++i) sorted[i] = (*values)[order[i]];
    *values = std::move(sorted);
  };
  apply(&channel->ticks);
  for (SignalColumn& column : channel->columns) apply(&column.values);
}

}  // namespace

bool IsSignal(const MessageType& type, std::string_view path) {
  if (path == "run_id" || path == "tick") return false;
  return std::ranges::find(type.count_names, path) == type.count_names.end();
}

std::vector<ChannelColumns> ReadColumns(const std::string& path, const RunRecord& run) {
  LogReader reader(path);
  std::map<std::string, ColumnLane, std::less<>> lanes;
  std::vector<std::string> order;
  for (const Channel& channel : run.spec.graph().channel()) {
    const MessageType* type = FindMessageType(channel.type());
    const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
    lanes.try_emplace(
        channel.name(),
        ColumnLane{type,
                   PacketFilter(type->fingerprint, static_cast<int>(type->encoded_size(counts)),
                                counts, run.spec.run_id()),
                   channel.external(),
                   ColumnAppender(type),
                   {},
                   {}});
    order.push_back(channel.name());
  }
  const MessageType* const health = FindMessageType("health_t");
  LogEvent event;
  while (reader.Next(&event)) {
    auto found = lanes.find(event.channel);
    if (found == lanes.end()) {
      if (!event.channel.starts_with("HEALTH_")) continue;
      order.emplace_back(event.channel);
      found = lanes
                  .try_emplace(order.back(),
                               ColumnLane{health, {}, false, ColumnAppender(health), {}, {}})
                  .first;
    }
    ColumnLane& lane = found->second;
    int64_t tick = 0;
    if (lane.filter) {
      if (lane.filter->Check(event.data.data(), event.data.size(), 0, run.num_ticks - 1) !=
          PacketVerdict::kAccepted) {
        continue;
      }
      tick = lane.filter->tick(event.data.data());
    } else {
      health_t message;
      if (!DecodeChecked(event.data.data(), static_cast<int64_t>(event.data.size()), &message) ||
          message.run_id != run.spec.run_id() || message.tick < 0 ||
          message.tick >= run.num_ticks) {
        continue;
      }
      tick = message.tick;
    }
    if (lane.external) {
      tick = static_cast<int64_t>(
          std::llround(static_cast<double>(event.utime) * 1e-6 / run.spec.tick_period()));
    }
    if (tick >= 0 && tick < run.num_ticks && !lane.Seen(tick)) lane.Append(tick, event.data);
  }

  std::vector<ChannelColumns> channels;
  for (const std::string& name : order) {
    ColumnLane& lane = lanes.find(name)->second;
    if (lane.ticks.empty()) continue;
    channels.push_back(
        {name, lane.type->name, std::move(lane.ticks), std::move(lane.appender.columns())});
    Sort(&channels.back());
  }
  return channels;
}

}  // namespace poise::logging
