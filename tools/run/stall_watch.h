// Tells that what should go on stands still.
#pragma once

#include <algorithm>
#include <cstdint>

namespace poise {

/// Wall time without a tick after which a run hangs, ns. A tick takes some 0.1 ms: a machine that
/// is busy with much else does not come near.
inline constexpr int64_t kStallPatience = 20'000'000'000;

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
  static constexpr int64_t kLongestLook = 500'000'000;  // ns

  int64_t progress_ = 0;
  int64_t last_look_ = 0;  // ns; 0: none yet
  int64_t stood_ = 0;      // ns
};

}  // namespace poise
