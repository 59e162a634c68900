#include "tools/foxglove/tick_messages.h"

#include <algorithm>
#include <array>

#include "components/framework/bus/packet_filter.h"
#include "logging/channel_ticks.h"
#include "poise/message_traits.hpp"

namespace poise {
namespace {

constexpr size_t kMostTicks = 8;  // that are gathered at a time

bool IsPart(std::string_view type) {
  static constexpr std::array kParts = {std::string_view(MessageTraits<robot_sensors_t>::kName),
                                        std::string_view(MessageTraits<robot_state_t>::kName),
                                        std::string_view(MessageTraits<support_plan_t>::kName),
                                        std::string_view(MessageTraits<planner_status_t>::kName),
                                        std::string_view(MessageTraits<balance_torque_t>::kName),
                                        std::string_view(MessageTraits<joint_command_t>::kName),
                                        std::string_view(MessageTraits<external_push_t>::kName),
                                        std::string_view(MessageTraits<ground_truth_t>::kName)};
  return std::ranges::find(kParts, type) != kParts.end();
}

template <class T>
bool Decode(std::string_view type, std::span<const uint8_t> data, std::optional<T>* message) {
  if (type != MessageTraits<T>::kName) return false;
  message->emplace();
  if (!DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &message->value())) {
    message->reset();
  }
  return true;
}

}  // namespace

TickGatherer::TickGatherer(const RunSpec& spec, int64_t every) : every_(every) {
  for (const Channel& channel : spec.graph().channel()) {
    channel_of_type_.try_emplace(logging::ChannelType(channel).name, channel.name());
  }
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
  if (added) messages.utime = ReadInt64(data.data() + type.run_id_offset + 16);
  const std::string_view name = type.name;
  Decode(name, data, &messages.sensors) || Decode(name, data, &messages.state) ||
      Decode(name, data, &messages.plan) || Decode(name, data, &messages.planner) ||
      Decode(name, data, &messages.balance) || Decode(name, data, &messages.command) ||
      Decode(name, data, &messages.push) || Decode(name, data, &messages.truth);
}

std::optional<TickMessages> TickGatherer::Take(bool end) {
  if (ticks_.empty()) return {};
  const auto oldest = ticks_.begin();
  const bool due = newest_ >= oldest->first + every_ && oldest->second.num_parts() == parts_.size();
  if (!end && !due && ticks_.size() <= kMostTicks) return {};
  TickMessages messages = std::move(oldest->second);
  taken_ = oldest->first;
  ticks_.erase(oldest);
  return messages;
}

}  // namespace poise
