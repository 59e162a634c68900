#include "logging/export/signal_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/operator_acts.h"
#include "derived/message_traits.hpp"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "logging/derived/derived_reader.h"
#include "logging/derived/told.h"
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

/// Puts one message's scalars into the rows of its channel.
class RowFiller : public ScalarVisitor {
 public:
  RowFiller(const MessageType* type, const PageRows* rows) : type_(type), rows_(rows) {}

  void Integer(std::string_view path, int64_t value) override {
    if (IsSignal(*type_, path)) Put(path, true, static_cast<double>(value));
  }
  void Real(std::string_view path, double value) override { Put(path, false, value); }
  void Text(std::string_view, std::string_view) override {}

  /// The row of the message that comes. False: it has none.
  bool BeginMessage(int64_t tick) {
    int64_t stride = 0;
    const int64_t row = rows_->RowOf(tick, &stride);
    row_ = static_cast<size_t>(row);
    next_ = 0;
    return row >= 0;
  }
  std::vector<RowColumn>& columns() { return columns_; }

 private:
  void Put(std::string_view path, bool integer, double value) {
    if (next_ == columns_.size()) {
      const std::vector<double> none(static_cast<size_t>(rows_->size()), std::nan(""));
      columns_.push_back({std::string(path), integer, none, {}, {}});
      if (!rows_->every_tick()) columns_.back().least = columns_.back().largest = none;
    }
    RowColumn& column = columns_[next_++];
    if (std::isnan(column.values[row_])) column.values[row_] = value;
    if (column.least.empty()) return;
    column.least[row_] = std::fmin(column.least[row_], value);
    column.largest[row_] = std::fmax(column.largest[row_], value);
  }

  const MessageType* type_;
  const PageRows* rows_;
  std::vector<RowColumn> columns_;
  size_t row_ = 0;
  size_t next_ = 0;
};

struct RowLane {
  const MessageType* type = nullptr;
  RowFiller filler;
  int64_t messages = 0;
  std::vector<bool> seen;  ///< by tick

  /// False: the tick has a message already.
  bool Take(int64_t tick) {
    const auto i = static_cast<size_t>(tick);
    if (i >= seen.size()) seen.resize(i + 1);
    if (seen[i]) return false;
    return seen[i] = true;
  }
};

struct ColumnLane {
  const MessageType* type;
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

/// Goes through a log's messages that columns are made of.
class ColumnSource {
 public:
  ColumnSource(const std::string& path, const RunRecord& run)
      : run_(run), reader_(path), events_(&reader_, run.spec, &run.robot) {
    for (const Channel& channel : run.spec.graph().channel()) {
      lanes_.try_emplace(channel.name(),
                         Lane{order_.size(), &ChannelType(channel),
                              ChannelFilter(run.spec, channel), channel.external()});
      order_.push_back(channel.name());
    }
  }

  /// The next message, of channel `*index` of names(), of a tick of the run. False at the end.
  bool Next(size_t* index, const MessageType** type, int64_t* tick,
            std::span<const uint8_t>* data) {
    LogEvent event;
    while (events_.Next(&event)) {
      auto found = lanes_.find(event.channel);
      if (found == lanes_.end()) {
        const bool derived = events_.IsDerived(event.channel);
        if (!derived && !event.channel.starts_with("HEALTH_")) continue;
        const char* const type = derived ? MessageTraits<derived::signals_t>::kName : "health_t";
        found = lanes_
                    .try_emplace(std::string(event.channel),
                                 Lane{order_.size(), FindMessageType(type), {}, false})
                    .first;
        order_.emplace_back(event.channel);
      }
      const Lane& lane = found->second;
      const std::optional<int64_t> at = TickOf(lane, event);
      if (!at || *at < 0 || *at >= run_.num_ticks) continue;
      *index = lane.index;
      *type = lane.type;
      *tick = *at;
      *data = WithoutUntold(*lane.type, event.data, &told_);
      return true;
    }
    return false;
  }
  const std::vector<std::string>& names() const { return order_; }

 private:
  struct Lane {
    size_t index;
    const MessageType* type;
    std::optional<PacketFilter> filter;  ///< none: HEALTH_*, checked as it is decoded, and DERIVED
    bool external;
  };

  std::optional<int64_t> TickOf(const Lane& lane, const LogEvent& event) const {
    if (events_.IsDerived(event.channel)) return LogMessages::Tick(*lane.type, event);
    if (!lane.filter) {
      health_t message;
      if (!DecodeChecked(event.data, &message) || message.run_id != run_.spec.run_id()) {
        return {};
      }
      return message.tick;
    }
    if (lane.filter->Check(event.data.data(), event.data.size(), 0, run_.num_ticks - 1) !=
        PacketVerdict::kAccepted) {
      return {};
    }
    if (!lane.external) return lane.filter->tick(event.data.data());
    return static_cast<int64_t>(
        std::llround(static_cast<double>(event.utime) * 1e-6 / run_.spec.tick_period()));
  }

  const RunRecord& run_;
  LogReader reader_;
  DerivedReader events_;
  std::map<std::string, Lane, std::less<>> lanes_;
  std::vector<std::string> order_;
  std::vector<uint8_t> told_;  // the last message, where some of it is left out
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

/// A derived signal that a run never tells is none.
template <class Column>
void LeaveOutEmpty(const MessageType& type, std::vector<Column>* columns) {
  if (std::string_view(type.name) != MessageTraits<derived::signals_t>::kName) return;
  std::erase_if(*columns, [](const Column& column) {
    return std::ranges::all_of(column.values, [](double value) { return std::isnan(value); });
  });
}

}  // namespace

bool IsSignal(const MessageType& type, std::string_view path) {
  if (path == "run_id" || path == "tick") return false;
  // The letters of a setting's name: 64 signals that nobody plots.
  if (type.name == kActType && path.starts_with("field[")) return false;
  return std::ranges::find(type.count_names, path) == type.count_names.end();
}

std::vector<ChannelColumns> ReadColumns(const std::string& path, const RunRecord& run) {
  ColumnSource source(path, run);
  std::vector<std::optional<ColumnLane>> lanes;
  size_t index = 0;
  const MessageType* type = nullptr;
  int64_t tick = 0;
  std::span<const uint8_t> data;
  while (source.Next(&index, &type, &tick, &data)) {
    if (index >= lanes.size()) lanes.resize(index + 1);
    std::optional<ColumnLane>& lane = lanes[index];
    if (!lane) lane.emplace(ColumnLane{type, ColumnAppender(type), {}, {}});
    if (!lane->Seen(tick)) lane->Append(tick, data);
  }
  std::vector<ChannelColumns> channels;
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (!lanes[i] || lanes[i]->ticks.empty()) continue;
    channels.push_back({source.names()[i], lanes[i]->type->name, std::move(lanes[i]->ticks),
                        std::move(lanes[i]->appender.columns())});
    LeaveOutEmpty(*lanes[i]->type, &channels.back().columns);
    Sort(&channels.back());
  }
  return channels;
}

std::vector<ChannelRows> ReadRows(const std::string& path, const RunRecord& run,
                                  const PageRows& rows) {
  ColumnSource source(path, run);
  std::vector<std::optional<RowLane>> lanes;
  size_t index = 0;
  const MessageType* type = nullptr;
  int64_t tick = 0;
  std::span<const uint8_t> data;
  while (source.Next(&index, &type, &tick, &data)) {
    if (index >= lanes.size()) lanes.resize(index + 1);
    std::optional<RowLane>& lane = lanes[index];
    if (!lane) lane.emplace(RowLane{type, RowFiller(type, &rows), 0, {}});
    if (!lane->filler.BeginMessage(tick) || !lane->Take(tick)) continue;
    if (type->visit(data.data(), static_cast<int64_t>(data.size()), &lane->filler)) {
      ++lane->messages;
    }
  }
  std::vector<ChannelRows> channels;
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (!lanes[i] || lanes[i]->messages == 0) continue;
    channels.push_back({source.names()[i], lanes[i]->type->name, lanes[i]->messages,
                        std::move(lanes[i]->filler.columns())});
    LeaveOutEmpty(*lanes[i]->type, &channels.back().columns);
  }
  return channels;
}

}  // namespace poise::logging
