// Tells that what should go on stands still.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <thread>

#include "tools/cli/child_process.h"

namespace poise {

/// Wall time without a tick after which a run hangs, ns. A tick takes some 0.1 ms: a machine that
/// is busy with much else does not come near.
inline constexpr int64_t kStallPatience = 20'000'000'000;

/// Wall time in which a process is ready, and each component configured, ns.
inline constexpr int64_t kReadyPatience = 30'000'000'000;

/// The most that counts between two questions of those who watch, ns.
inline constexpr int64_t kLongestLook = 500'000'000;

/// Asked again and again. Between two questions at most kLongestLook counts, so that a debugger's
/// halt, Ctrl-Z or a frozen container, which stop the one who asks as well, do not.
class StallWatch {
 public:
  /// `progress`: any number that changes while it goes on. `now`: ns. Returns for how long it has
  /// not, ns.
  int64_t Stood(int64_t progress, int64_t now) {
    const bool first = last_look_ == 0;
    const int64_t gap = first ? 0 : std::min(now - last_look_, kLongestLook);
    stood_ = first || progress != progress_ ? 0 : stood_ + gap;
    progress_ = progress;
    last_look_ = now;
    return stood_;
  }

 private:
  int64_t progress_ = 0;
  int64_t last_look_ = 0;  // ns; 0: none yet
  int64_t stood_ = 0;      // ns
};

/// Asks a StallWatch in a thread of its own, for what blocks this one, until that is joined.
/// `progress`: any number that changes while it goes on; negative: what may last. `stalled`: is
/// called with it, in that thread, once it has not changed for `patience`, ns.
std::jthread WatchForStall(int64_t patience, std::function<int64_t()> progress,
                           std::function<void(int64_t)> stalled);

/// Measures for how long a process has said nothing though it could have. It is asked again and
/// again: of the time between two questions neither what the process waited for a processor counts,
/// nor more than kLongestLook (StallWatch).
class SilenceWatch {
 public:
  /// How long process `pid` has been silent, its last word heard at `heard`; a successor has said
  /// nothing yet and begins anew. `now`: ns. Returns ns.
  int64_t Silent(int64_t pid, int64_t heard, const ProcessorTime& time, int64_t now) {
    if (pid != pid_ || heard != heard_) {
      silent_ = 0;
    } else {
      const int64_t gap = std::min(now - last_look_, kLongestLook);
      const bool waits = time.ready && time.used == last_.used;
      silent_ += waits ? 0 : gap - std::clamp<int64_t>(time.waited - last_.waited, 0, gap);
    }
    pid_ = pid;
    heard_ = heard;
    last_ = time;
    last_look_ = now;
    return silent_;
  }

 private:
  int64_t pid_ = 0, heard_ = 0;  // ns
  ProcessorTime last_;
  int64_t last_look_ = 0, silent_ = 0;  // ns
};

}  // namespace poise
