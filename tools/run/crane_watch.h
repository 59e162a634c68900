// Sees when the simulated robot's crane lets go.
#pragma once

#include <memory>
#include <optional>

#include "poise/ground_truth_t.hpp"
#include "tools/run/channel_tap.h"

namespace poise {

/// Reads GROUND_TRUTH until the crane has let go.
class CraneWatch {
 public:
  /// Reads nothing when the run has no ground truth or no lead. Throws BusError.
  explicit CraneWatch(const RunSpec& spec);

  /// -1: nothing more to read.
  int fd() const { return tap_ ? tap_->fd() : -1; }
  /// Takes what has arrived.
  void Receive();
  /// s of the scenario's time; empty: not yet, or there is no crane.
  std::optional<double> let_go() const { return let_go_; }

 private:
  double period_;  // s
  int64_t lead_;   // ticks
  std::unique_ptr<ChannelTap<ground_truth_t>> tap_;
  bool held_ = false;
  std::optional<double> let_go_;
};

}  // namespace poise
