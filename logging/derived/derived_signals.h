// The signals that follow from a run's messages: derived::signals_t, tick by tick. The page, CSV,
// MCAP and Python read these and compute none of their own.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "logging/derived/definitions.h"
#include "logging/derived/footprint.h"
#include "logging/derived/tick_messages.h"

namespace poise::logging {

/// Computes the signals of a run's ticks.
class DerivedSignals {
 public:
  /// `robot` must outlive it.
  DerivedSignals(const RunSpec& spec, const robot::RobotModel& robot);

  /// False: the run's channels, or their counts, do not fit the robot or tell none of the signals,
  /// or one of them is called kDerivedChannel itself.
  bool any() const { return any_; }
  /// True when the run has the messages that the field of this path follows from.
  bool Tells(std::string_view path) const;
  const std::vector<int32_t>& counts() const { return counts_; }

  /// The signals of a tick; ticks in ascending order.
  const derived::signals_t& Next(TickMessages now);

 private:
  const robot::RobotModel& robot_;
  RunMessages run_;
  int64_t run_id_, lead_ticks_;
  double period_;       // s
  uint32_t types_ = 0;  // that the graph has
  bool any_ = false;
  std::vector<int32_t> counts_;
  TickMessages before_;
  std::optional<Eigen::Vector3d> first_com_, first_true_com_;
  std::array<Footprint, 2> prints_;
  derived::signals_t signals_;
};

/// The signals as encoded messages of kDerivedChannel, from the messages of a run as they come.
class DerivedMessages {
 public:
  /// `most`: ticks that are gathered until those come that are late.
  DerivedMessages(const RunSpec& spec, const robot::RobotModel& robot,
                  size_t most = TickGatherer::kFewTicks);

  const DerivedSignals& signals() const { return signals_; }
  /// The message must be well formed, of the run and with its channel's counts.
  void Add(std::string_view channel, const MessageType& type, std::span<const uint8_t> data) {
    if (signals_.any()) gatherer_.Add(channel, type, data);
  }
  /// The next tick's message, if no part of it is expected any more; with `end` what is left.
  /// False: there is none. `data` until the next call.
  bool Take(bool end, int64_t* utime, std::span<const uint8_t>* data);
  /// That of a tick, as far as its messages have come; earlier ones are let go.
  bool TakeTick(int64_t tick, std::span<const uint8_t>* data);

 private:
  void Encode(TickMessages messages, std::span<const uint8_t>* data);

  DerivedSignals signals_;
  TickGatherer gatherer_;
  std::vector<uint8_t> bytes_;
};

}  // namespace poise::logging
