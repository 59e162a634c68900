#include "tools/cli/progress.h"

#include <unistd.h>

#include <cstdio>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr double kRewriteInterval = 0.1;  // s, on a terminal
constexpr double kLineInterval = 2;       // s, elsewhere

}  // namespace

StatusLine::StatusLine(bool quiet)
    : quiet_(quiet), terminal_(isatty(STDOUT_FILENO) != 0), next_(terminal_ ? 0 : kLineInterval) {}

void StatusLine::Show(const std::string& text, double wall) {
  next_ = wall + (terminal_ ? kRewriteInterval : kLineInterval);
  fmt::print("{}  {}{}", terminal_ ? "\r" : "", text, terminal_ ? "\x1b[K" : "\n");
  std::fflush(stdout);
  shown_ = true;
}

void StatusLine::Clear() {
  if (terminal_ && shown_) fmt::print("\r\x1b[K");
  std::fflush(stdout);
  shown_ = false;
}

void Progress::Show(double time, double wall) {
  if (!line_.Due(wall)) return;
  if (time < 0) {
    line_.Show(fmt::format("{:.2f} s: the robot starts", time), wall);
    return;
  }
  line_.Show(fmt::format("{:.2f} of {:.2f} s simulated, {:.1f} x real time", time, duration_,
                         wall > 0 ? (time + lead_) / wall : 0.0),
             wall);
}

}  // namespace poise
