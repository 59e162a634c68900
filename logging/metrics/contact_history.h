// What happened to the feet in a run: changes of support, touch-downs, contacts lost.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "logging/metrics/analysis.h"

namespace poise::logging {

/// "left foot", by the robot's name for it.
std::string FootName(const RunRecord& run, size_t foot);

/// "both feet", "no foot", "left foot": which ones carry, by foot.
std::string SupportName(const RunRecord& run, const std::array<bool, 2>& contacts);

/// The contact state of the command changed from one tick to the next.
struct SupportChange {
  int64_t tick = 0;  ///< the first with the other support
  std::array<bool, 2> before{}, after{};
  double torque_step = 0;  ///< N·m, largest change of a joint's command in that tick
  size_t joint = 0;        ///< of that joint
  bool lifted(size_t foot) const { return before[foot] && !after[foot]; }
};
/// All of the run, in order.
std::vector<SupportChange> SupportChanges(const RunRecord& run);

enum class Timing { kUnknown, kExpected, kEarly, kLate };

/// The measured load of a foot that came down lasted: contact, once per lift-off.
struct TouchDown {
  int64_t tick = 0;
  size_t foot = 0;
  double height = 0;  ///< m, estimated, of the sole above the other one
  /// m, estimated sole above the end of its reference; empty when the plan is not known.
  std::optional<double> above_end;
  Timing timing = Timing::kUnknown;
};
/// All of the run, in order.
std::vector<TouchDown> TouchDowns(const RunRecord& run);

/// True when a foot in contact that was to be loaded (kLoadedShare) reads no more than its sensor's
/// noise at `tick`; empty for a foot out of contact or not to be loaded.
std::optional<bool> ContactLost(const RunRecord& run, size_t foot, int64_t tick);

/// Ticks [begin, end) in which `holds` is true; `end` empty when it still is at the run's end.
/// Interruptions of up to `gap` ticks are bridged; a tick without an answer is as the one before.
struct Interval {
  int64_t begin = 0;
  std::optional<int64_t> end;
};
std::vector<Interval> Intervals(const RunRecord& run,
                                const std::function<std::optional<bool>(int64_t tick)>& holds,
                                int64_t gap = 0);

}  // namespace poise::logging
