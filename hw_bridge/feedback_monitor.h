// FeedbackMonitor: which readings of the drives can be true, and the joints' velocities.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "components/robot/robot_model.h"
#include "poise/drive_feedback_t.hpp"

namespace poise {

struct FeedbackMonitorConfig {
  std::vector<double> velocity_limit;  ///< rad/s, by joint; empty: jumps are not looked for
  /// From one cycle to the next no joint moves further than this many times velocity_limit ×
  /// period: a fall or an impact may exceed the limit itself for a while; five times it is a broken
  /// encoder.
  double velocity_margin = 5;
  double velocity_cutoff = 60;  ///< Hz
  int num_feet = 2;
  double period = 0.002;  ///< s, of a cycle
  /// An encoder is frozen when it has not moved by a count for `frozen_cycles`, the last
  /// `response_cycles` of them after the torque has changed by more than `frozen_torque`, N·m: a
  /// joint that stands still takes some time until such a change has moved it.
  int frozen_cycles = 50, response_cycles = 10;
  double frozen_torque = std::numeric_limits<double>::infinity();
  /// A torque is implausible when it has differed by more than `torque_error`, N·m, from all that
  /// was commanded in the last `current_cycles`, as old as a reading may be, for
  /// `torque_error_cycles` in a row.
  int torque_error_cycles = 10, current_cycles = 1;
  double torque_error = std::numeric_limits<double>::infinity();
};

/// Whether a sensor of a robot can read this: false for what is no number, or beyond all reason.
bool Plausible(const wrench_t& wrench);

/// Never allocates after construction, never throws.
class FeedbackMonitor {
 public:
  FeedbackMonitor(const FeedbackMonitorConfig& config, std::span<const robot::MotorModel> motors);

  struct Problem {
    int8_t reason = 0;  ///< bridge_status_t::REASON_*; REASON_NONE: the feedback can be used
    int joint = -1;
  };
  /// Looks at a cycle's feedback and, when it can be used, takes counts and velocities from it.
  Problem Update(const drive_feedback_t& feedback);
  /// Ends the cycle: what was commanded in it.
  void EndCycle(std::span<const double> current, std::span<const int8_t> enabled);
  /// Forgets what has been found so far, not the counts.
  void Reset();

  bool updated() const { return updated_; }  ///< in this cycle
  bool known() const { return known_; }      ///< counts have been read at least once
  /// The last usable feedback had these counts.
  const std::vector<int64_t>& counts() const { return counts_; }
  /// rad/s, filtered, from the encoder counts.
  const std::vector<double>& velocity() const { return velocity_; }
  /// rad/s, likewise unfiltered: over the last two cycles that followed each other.
  const std::vector<double>& raw_velocity() const { return raw_velocity_; }

 private:
  Problem Find(const drive_feedback_t& feedback) const;
  int FindJump(const drive_feedback_t& feedback) const;
  Problem FindFault(const drive_feedback_t& feedback);

  FeedbackMonitorConfig config_;
  std::vector<robot::MotorModel> motors_;
  double velocity_gain_;  // of the first-order low-pass, per cycle
  std::vector<int64_t> counts_;
  std::vector<double> velocity_, raw_velocity_;
  std::vector<std::vector<double>> commanded_;  // A, in the cycles before, the last one first
  std::vector<char> enabled_;
  std::vector<int> still_cycles_, changed_cycles_, error_cycles_;
  std::vector<double> least_torque_, greatest_torque_;  // N·m, commanded since the last movement
  bool known_ = false, updated_ = false;
  bool consecutive_ = false;  // counts_ are those of the cycle before
};

}  // namespace poise
