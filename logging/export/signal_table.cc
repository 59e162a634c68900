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

/// A channel as it is read.
struct Lane {
  std::string name;
  const MessageType* type;
  std::optional<PacketFilter> filter;  ///< none: HEALTH_*, checked as it is decoded, and DERIVED
  bool external;
  RowFiller filler;
  int64_t messages = 0;
  std::vector<bool> seen = {};  ///< by tick
};

std::optional<int64_t> TickOf(const RunRecord& run, const Lane& lane, bool derived,
                              const LogEvent& event) {
  if (derived) return LogMessages::Tick(*lane.type, event);
  if (!lane.filter) {
    health_t message;
    const bool good = DecodeChecked(event.data, &message) && message.run_id == run.spec.run_id();
    return good ? std::optional(message.tick) : std::nullopt;
  }
  if (lane.filter->Check(event.data.data(), event.data.size(), 0, run.num_ticks - 1) !=
      PacketVerdict::kAccepted) {
    return {};
  }
  if (!lane.external) return lane.filter->tick(event.data.data());
  return static_cast<int64_t>(
      std::llround(static_cast<double>(event.utime) * 1e-6 / run.spec.tick_period()));
}

/// The channels that have messages in `rows`.
std::vector<Lane> ReadLanes(const std::string& path, const RunRecord& run, const PageRows& rows) {
  std::vector<Lane> lanes;
  std::map<std::string, size_t, std::less<>> index;
  const auto add = [&](const std::string& name, const MessageType& type,
                       std::optional<PacketFilter> filter, bool external) {
    const auto [place, added] = index.try_emplace(name, lanes.size());
    if (added) lanes.push_back({name, &type, std::move(filter), external, RowFiller(&type, &rows)});
    return place;
  };
  for (const Channel& channel : run.spec.graph().channel()) {
    add(channel.name(), ChannelType(channel), ChannelFilter(run.spec, channel), channel.external());
  }
  LogReader reader(path);
  DerivedReader events(&reader, run.spec, &run.robot);
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
    Lane& lane = lanes[found->second];
    const std::optional<int64_t> tick = TickOf(run, lane, derived, event);
    if (!tick || *tick < 0 || *tick >= run.num_ticks) continue;
    const auto i = static_cast<size_t>(*tick);
    if (i >= lane.seen.size()) lane.seen.resize(i + 1);
    if (lane.seen[i] || !lane.filler.BeginMessage(*tick)) continue;
    const std::span<const uint8_t> data = WithoutUntold(*lane.type, event.data, &told);
    lane.seen[i] = lane.type->visit(data.data(), static_cast<int64_t>(data.size()), &lane.filler);
    lane.messages += lane.seen[i] ? 1 : 0;
  }
  std::erase_if(lanes, [](const Lane& lane) { return lane.messages == 0; });
  for (Lane& lane : lanes) {
    // A derived signal that a run never tells is none.
    if (std::string_view(lane.type->name) != MessageTraits<derived::signals_t>::kName) continue;
    std::erase_if(lane.filler.columns(), [](const SignalColumn& column) {
      return std::ranges::all_of(column.values, [](double value) { return std::isnan(value); });
    });
  }
  return lanes;
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
  for (Lane& lane : ReadLanes(path, run, rows)) {
    std::vector<int64_t> ticks;
    for (size_t tick = 0; tick < lane.seen.size(); ++tick) {
      if (lane.seen[tick]) ticks.push_back(static_cast<int64_t>(tick));
    }
    for (SignalColumn& column : lane.filler.columns()) {
      std::vector<double> values;
      for (const int64_t tick : ticks) values.push_back(column.values[static_cast<size_t>(tick)]);
      column.values = std::move(values);
    }
    channels.push_back({lane.name, lane.type->name, lane.messages, std::move(ticks),
                        std::move(lane.filler.columns())});
  }
  return channels;
}

std::vector<ChannelColumns> ReadRows(const std::string& path, const RunRecord& run,
                                     const PageRows& rows) {
  std::vector<ChannelColumns> channels;
  for (Lane& lane : ReadLanes(path, run, rows)) {
    channels.push_back(
        {lane.name, lane.type->name, lane.messages, {}, std::move(lane.filler.columns())});
  }
  return channels;
}

}  // namespace poise::logging
