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
  /// Whether it held in the last tick.
  bool holds() const { return holds_; }
  void Archive(StateArchive* archive) { archive->Show(holds_, since_); }

 private:
  bool holds_ = false;
  double since_ = 0;
};

/// A condition with hysteresis in time: it changes once it has been contradicted for long enough,
/// so that neither noise nor skipped ticks change it.
class HeldCondition {
 public:
  /// `holds`: what holds until it has been contradicted.
  void Reset(bool holds) {
    holds_ = holds;
    contradicted_.Reset();
  }
  /// Once a tick: what holds after `seen` in it; `duration`: s that a contradiction must last.
  bool Update(double time, bool seen, double duration) {
    if (contradicted_.Update(time, seen != holds_, duration)) Reset(!holds_);
    return holds_;
  }
  bool holds() const { return holds_; }
  void Archive(StateArchive* archive) { archive->Show(holds_, contradicted_); }

 private:
  bool holds_ = false;
  LastingCondition contradicted_;
};

}  // namespace poise
