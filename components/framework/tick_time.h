// Time as control counts it from tick to tick.
#pragma once

#include <algorithm>

#include "components/framework/state_archive.h"

namespace poise {

/// Times are compared to this, s: far below a tick, far above rounding.
inline constexpr double kTimeTolerance = 1e-9;
/// A tick after a gap of the ticks counts as this long at most, s.
inline constexpr double kLongestTick = 0.02;

/// s that a tick counts, which comes `elapsed` s after the last one.
inline double TickPeriod(double elapsed) { return std::clamp(elapsed, 0.0, kLongestTick); }

/// A condition that has to last until it counts: a load on a sole, a capture point beyond it.
class LastingCondition {
 public:
  /// Forgets since when it holds.
  void Reset() { holds_ = false; }
  /// Once a tick: whether `holds` has been true in every tick for `duration` s. `time`: s, not
  /// decreasing.
  bool Update(double time, bool holds, double duration) {
    if (!holds) {
      Reset();
      return false;
    }
    if (!holds_) since_ = time;
    holds_ = true;
    return time - since_ >= duration - kTimeTolerance;
  }
  /// Whether it held in the last tick, and since when, s.
  bool holds() const { return holds_; }
  double since() const { return since_; }
  void Archive(StateArchive* archive) { archive->Show(holds_, since_); }

 private:
  bool holds_ = false;
  double since_ = 0;
};

}  // namespace poise
