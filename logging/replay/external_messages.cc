#include "logging/replay/external_messages.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "components/framework/run.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

using Statuses = Series<std::span<const uint8_t>>;

constexpr int64_t kReach = kMaxLead + kReceiveWindow;  // ticks

template <class T>
std::optional<T> Decode(std::span<const uint8_t> data) {
  T message;
  if (!DecodeChecked(data, &message)) return {};
  return message;
}

/// The tick nearest to `near`, and not before `first`, of whose status and the one before it
/// `happened` is true; before tick 0 there is none (nullptr).
template <class Happened>
std::optional<int64_t> NearestTick(const Statuses& statuses, int64_t near, int64_t first,
                                   Happened happened) {
  std::optional<int64_t> nearest;
  const int64_t begin = std::max({first, near - kReach, int64_t{0}});
  std::optional<bridge_status_t> before = StatusAt(statuses, begin - 1);
  for (int64_t tick = begin; tick <= near + kReach; ++tick) {
    std::optional<bridge_status_t> now = StatusAt(statuses, tick);
    if (now && (before || tick == 0) && happened(before ? &*before : nullptr, *now) &&
        (!nearest || std::abs(tick - near) < std::abs(*nearest - near))) {
      nearest = tick;
    }
    before = std::move(now);
  }
  return nearest;
}

bool Stopped(const bridge_status_t& status) { return status.state == bridge_status_t::STATE_ESTOP; }

/// Whether an operator's message stopped the bridge, as far as the reason tells: a stop within a
/// stop leaves the reason of the first.
bool StoppedByMessage(const bridge_status_t* before, const bridge_status_t& now) {
  return Stopped(now) && (before == nullptr || !Stopped(*before)) &&
         now.reason != bridge_status_t::REASON_DRIVE_STO &&
         now.reason != bridge_status_t::REASON_SIGNAL &&
         now.reason != bridge_status_t::REASON_REMOTE_STOP;
}

bool Reset(const bridge_status_t* before, const bridge_status_t& now) {
  return now.resets > (before == nullptr ? 0 : before->resets);
}

}  // namespace

std::optional<bridge_status_t> StatusAt(const Series<std::span<const uint8_t>>& statuses,
                                        int64_t tick) {
  const std::span<const uint8_t>* const data = statuses.at(tick);
  return data == nullptr ? std::nullopt : Decode<bridge_status_t>(*data);
}

void PlaceEmergencyStops(const Statuses& statuses, std::vector<ExternalMessage>* stops) {
  bool stop = false;
  bool reset = false;
  int64_t last = 0;
  for (ExternalMessage& message : *stops) {
    message.tick = std::max(message.tick, last);
    const auto content = Decode<emergency_stop_t>(message.data);
    if (!content) continue;
    const bool stops_now = content->stop != 0 && !stop;
    const bool resets_now = content->reset != 0 && !reset;
    const bool changes = (content->stop != 0) != stop || (content->reset != 0) != reset;
    stop = content->stop != 0;
    reset = content->reset != 0;
    message.certain = !changes;
    std::optional<int64_t> tick;
    if (stops_now) tick = NearestTick(statuses, message.tick, last, StoppedByMessage);
    if (resets_now && !tick) tick = NearestTick(statuses, message.tick, last, Reset);
    if (tick) {
      message.tick = *tick;
      message.certain = true;
    } else if (stops_now && !resets_now) {
      // It had no effect on a bridge that had stopped by then.
      const auto before = StatusAt(statuses, std::max(message.tick - kReach, last));
      message.certain = before && Stopped(*before);
    }
    if (message.certain && changes) last = message.tick;
  }
  // What came before another message was read before it.
  for (size_t i = stops->size(); i-- > 1;) {
    (*stops)[i - 1].tick = std::min((*stops)[i - 1].tick, (*stops)[i].tick);
  }
}

}  // namespace poise::logging
