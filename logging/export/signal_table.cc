#include "logging/export/signal_table.h"

#include <algorithm>
#include <cmath>
#include <map>
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
  std::vector<SignalColumn>& columns() { return columns_; }

 private:
  void Put(std::string_view path, bool integer, double value) {
    if (next_ == columns_.size()) {
      const std::vector<double> none(static_cast<size_t>(rows_->size()), std::nan(""));
      columns_.push_back({std::string(path), integer, none});
      if (!rows_->every_tick()) columns_.back().least = columns_.back().largest = none;
    }
    SignalColumn& column = columns_[next_++];
    if (std::isnan(column.values[row_])) column.values[row_] = value;
    if (column.least.empty()) return;
    column.least[row_] = std::fmin(column.least[row_], value);
    column.largest[row_] = std::fmax(column.largest[row_], value);
  }

  const MessageType* type_;
  const PageRows* rows_;
  std::vector<SignalColumn> columns_;
  size_t row_ = 0;
  size_t next_ = 0;
};

struct ChannelRead {
  std::string name;
  const MessageType* type;
  std::optional<PacketFilter> filter;  ///< none: HEALTH_*, checked as it is decoded, and DERIVED
  bool external;
  RowFiller filler;
  int64_t messages = 0;
  std::vector<bool> seen = {};  ///< by tick
};

std::optional<int64_t> TickOf(const RunRecord& run, const ChannelRead& channel, bool derived,
                              const LogEvent& event) {
  if (derived) return LogMessages::Tick(*channel.type, event);
  if (!channel.filter) {
    health_t message;
    const bool good = DecodeChecked(event.data, &message) && message.run_id == run.spec.run_id();
    return good ? std::optional(message.tick) : std::nullopt;
  }
  if (channel.filter->Check(event.data.data(), event.data.size(), 0, run.num_ticks - 1) !=
      PacketVerdict::kAccepted) {
    return {};
  }
  if (!channel.external) return channel.filter->tick(event.data.data());
  return static_cast<int64_t>(
      std::llround(static_cast<double>(event.utime) * 1e-6 / run.spec.tick_period()));
}

std::vector<ChannelRead> ReadChannels(const std::string& path, const RunRecord& run,
                                      const PageRows& rows) {
  std::vector<ChannelRead> channels;
  std::map<std::string, size_t, std::less<>> index;
  const auto add = [&](const std::string& name, const MessageType& type,
                       std::optional<PacketFilter> filter, bool external) {
    const auto [place, added] = index.try_emplace(name, channels.size());
    if (added) {
      channels.push_back({name, &type, std::move(filter), external, RowFiller(&type, &rows)});
    }
    return place;
  };
  for (const Channel& channel : run.spec.graph().channel()) {
    add(channel.name(), ChannelType(channel), ChannelFilter(run.spec, channel), channel.external());
  }
  LogReader reader(path);
  DerivedReader events(&reader, run.spec, run.robot);
  std::vector<uint8_t> told;  // the last message, where some of it is left out
  LogEvent event;
  while (events.Next(&event)) {
    auto found = index.find(event.channel);
    const bool derived = events.IsDerived(event.channel);
    if (found == index.end()) {
      if (!derived && !event.channel.starts_with("HEALTH_")) continue;
      const char* const type = derived ? MessageTraits<derived::signals_t>::kName : "health_t";
      found = add(std::string(event.channel), *FindMessageType(type), {}, false);
    }
    ChannelRead& channel = channels[found->second];
    const std::optional<int64_t> tick = TickOf(run, channel, derived, event);
    if (!tick || *tick < 0 || *tick >= run.num_ticks) continue;
    const auto i = static_cast<size_t>(*tick);
    if (i >= channel.seen.size()) channel.seen.resize(i + 1);
    if (channel.seen[i] || !channel.filler.BeginMessage(*tick)) continue;
    const std::span<const uint8_t> data = WithoutUntold(*channel.type, event.data, &told);
    channel.seen[i] =
        channel.type->visit(data.data(), static_cast<int64_t>(data.size()), &channel.filler);
    channel.messages += channel.seen[i] ? 1 : 0;
  }
  std::erase_if(channels, [](const ChannelRead& channel) { return channel.messages == 0; });
  for (ChannelRead& channel : channels) {
    // A derived signal that a run never tells is none.
    if (std::string_view(channel.type->name) != MessageTraits<derived::signals_t>::kName) continue;
    std::erase_if(channel.filler.columns(), [](const SignalColumn& column) {
      return std::ranges::all_of(column.values, [](double value) { return std::isnan(value); });
    });
  }
  return channels;
}

}  // namespace

bool IsSignal(const MessageType& type, std::string_view path) {
  if (path == "run_id" || path == "tick") return false;
  // The letters of a setting's name: 64 signals that nobody plots.
  if (type.name == kActType && path.starts_with("field[")) return false;
  return std::ranges::find(type.count_names, path) == type.count_names.end();
}

std::vector<ChannelColumns> ReadColumns(const std::string& path, const RunRecord& run) {
  const PageRows rows(0, run.num_ticks);
  std::vector<ChannelColumns> channels;
  for (ChannelRead& channel : ReadChannels(path, run, rows)) {
    std::vector<int64_t> ticks;
    for (size_t tick = 0; tick < channel.seen.size(); ++tick) {
      if (channel.seen[tick]) ticks.push_back(static_cast<int64_t>(tick));
    }
    for (SignalColumn& column : channel.filler.columns()) {
      std::vector<double> values;
      for (const int64_t tick : ticks) values.push_back(column.values[static_cast<size_t>(tick)]);
      column.values = std::move(values);
    }
    channels.push_back({channel.name, channel.type->name, channel.messages, std::move(ticks),
                        std::move(channel.filler.columns())});
  }
  return channels;
}

std::vector<ChannelColumns> ReadRows(const std::string& path, const RunRecord& run,
                                     const PageRows& rows) {
  std::vector<ChannelColumns> channels;
  for (ChannelRead& channel : ReadChannels(path, run, rows)) {
    channels.push_back({channel.name,
                        channel.type->name,
                        channel.messages,
                        {},
                        std::move(channel.filler.columns())});
  }
  return channels;
}

}  // namespace poise::logging
