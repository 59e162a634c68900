// A run's progress on the terminal.
#pragma once

#include <cstdint>

namespace poise {

/// One line that rewrites itself on a terminal; elsewhere a line every few seconds.
class Progress {
 public:
  /// `duration`: s of the whole run. Quiet: shows nothing.
  Progress(double duration, bool quiet);
  /// Simulated time and wall time since the start, s. Cheap: shows only when it is time to.
  void Show(double time, double wall);
  /// Removes the line from a terminal.
  void Clear();

 private:
  double duration_;
  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  double next_;  // wall time from which to show again
};

}  // namespace poise
