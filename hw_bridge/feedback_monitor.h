// FeedbackMonitor: which readings of the drives can be true, and the joints' velocities.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hw_bridge/supervisor_config.h"
#include "poise/drive_feedback_t.hpp"

namespace poise {

/// Whether a sensor of a robot can read this: false for what is no number, or beyond all reason.
bool Plausible(const wrench_t& wrench);

/// Never allocates after construction, never throws.
class FeedbackMonitor {
 public:
  explicit FeedbackMonitor(const SupervisorConfig& config);

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

  SupervisorConfig config_;
  int frozen_cycles_, response_cycles_;
  double velocity_gain_;  // of the first-order low-pass, per cycle
  std::vector<int64_t> counts_;
  std::vector<double> velocity_, raw_velocity_;
  std::vector<std::vector<double>> commanded_;  // A, in the cycles before, the last one first
  struct Watch {
    bool enabled = false;
    int still_cycles = 0, changed_cycles = 0, error_cycles = 0;
    double least_torque = 0, greatest_torque = 0;  // N·m, commanded since the last movement
  };
  std::vector<Watch> watches_;  // by joint
  bool known_ = false, updated_ = false;
  bool consecutive_ = false;  // counts_ are those of the cycle before
};

}  // namespace poise
