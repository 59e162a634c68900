#include "logging/derived/tick_messages.h"

#include <algorithm>

#include "components/framework/bus/packet_filter.h"
#include "derived/message_traits.hpp"
#include "logging/channel_ticks.h"
#include "poise/message_traits.hpp"
#include "steps/message_traits.hpp"

namespace poise::logging {
namespace {

bool IsPart(std::string_view type) {
  bool part = false;
  TickView().VisitMessages(
      [&]<class T>(const T*&) { part = part || type == MessageTraits<T>::kName; });
  return part;
}

}  // namespace

TickView TickMessages::view() const {
  const auto at = [](const auto& message) { return message ? &*message : nullptr; };
  return {at(sensors), at(state),  at(estimator), at(plan),  at(planner),   at(balance),
          at(command), at(bridge), at(push),      at(truth), at(footsteps), at(derived)};
}

size_t TickMessages::num_parts() const {
  size_t count = 0;
  view().VisitMessages([&](const auto* message) { count += message != nullptr; });
  return count;
}

bool TickMessages::Take(std::string_view type, std::span<const uint8_t> data) {
  bool taken = false;
  VisitMessages([&]<class T>(std::optional<T>& message) {
    if (type != MessageTraits<T>::kName || message) return;
    message.emplace();
    taken = DecodeChecked(data, &*message) &&
            (std::is_same_v<T, derived::signals_t> || MessageTraits<T>::AllFinite(*message));
    if (!taken) message.reset();
  });
  return taken;
}

TickGatherer::TickGatherer(const RunSpec& spec, int64_t every, size_t most)
    : every_(every), most_(most) {
  for (const Channel& channel : spec.graph().channel()) {
    channel_of_type_.try_emplace(ChannelType(channel).name, channel.name());
  }
  channel_of_type_.try_emplace(MessageTraits<derived::signals_t>::kName, kDerivedChannel);
}

void TickGatherer::Add(std::string_view channel, const MessageType& type,
                       std::span<const uint8_t> data) {
  if (!type.has_header) return;
  const auto named = channel_of_type_.find(std::string_view(type.name));
  if (named == channel_of_type_.end() || named->second != channel) return;
  const int64_t tick = ReadInt64(data.data() + type.run_id_offset + 8);
  if (tick <= taken_) return;
  newest_ = std::max(newest_, tick);
  if (!IsPart(type.name)) return;
  if (!parts_.contains(std::string_view(type.name))) parts_.emplace(type.name);
  if (tick % every_ != 0) return;
  const auto [place, added] = ticks_.try_emplace(tick);
  TickMessages& messages = place->second;
  if (added) {
    messages.tick = tick;
    messages.utime = ReadInt64(data.data() + type.run_id_offset + 16);
  }
  messages.Take(type.name, data);
}

std::optional<TickMessages> TickGatherer::Take(bool end) {
  if (ticks_.empty()) return {};
  const auto oldest = ticks_.begin();
  const bool due = newest_ - oldest->first >= every_ && oldest->second.num_parts() == parts_.size();
  if (!end && !due && ticks_.size() <= most_) return {};
  return TakeTick(oldest->first);
}

std::optional<TickMessages> TickGatherer::TakeTick(int64_t tick) {
  ticks_.erase(ticks_.begin(), ticks_.lower_bound(tick));
  taken_ = std::max(taken_, tick);
  const auto found = ticks_.extract(tick);
  if (!found) return {};
  return std::move(found.mapped());
}

}  // namespace poise::logging
