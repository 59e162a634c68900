#include "deploy/poise/progress.h"

#include <unistd.h>

#include <cstdio>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr double kRewriteInterval = 0.1;  // s, on a terminal
constexpr double kLineInterval = 2;       // s, elsewhere

}  // namespace

Progress::Progress(double duration, bool quiet)
    : duration_(duration),
      quiet_(quiet),
      terminal_(isatty(STDOUT_FILENO) != 0),
      next_(terminal_ ? 0 : kLineInterval) {}

void Progress::Show(double time, double wall) {
  if (quiet_ || wall < next_) return;
  next_ = wall + (terminal_ ? kRewriteInterval : kLineInterval);
  fmt::print("{}  {:.2f} of {:.2f} s simulated, {:.1f} x real time{}", terminal_ ? "\r" : "", time,
             duration_, wall > 0 ? time / wall : 0.0, terminal_ ? "\x1b[K" : "\n");
  std::fflush(stdout);
  shown_ = true;
}

void Progress::Clear() {
  if (terminal_ && shown_) fmt::print("\r\x1b[K");
  std::fflush(stdout);
  shown_ = false;
}

}  // namespace poise
