#include "tools/cli/progress.h"

#include <unistd.h>

#include <condition_variable>
#include <cstdio>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr double kRewriteInterval = 0.1;  // s, on a terminal
constexpr double kLineInterval = 2;       // s, elsewhere
constexpr double kQuietStage = 1;         // s
constexpr std::chrono::milliseconds kStageInterval{250};

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

StageLine::StageLine(bool quiet)
    : line_(quiet),
      made_(std::chrono::steady_clock::now()),
      thread_([this](const std::stop_token& stop) { Run(stop); }) {}

void StageLine::Begin(const std::string& stage) {
  const std::lock_guard lock(mutex_);
  stage_ = stage;
  begin_ = std::chrono::steady_clock::now();
}

void StageLine::End() {
  const std::lock_guard lock(mutex_);
  stage_.clear();
  line_.Clear();
}

void StageLine::Run(const std::stop_token& stop) {
  using Seconds = std::chrono::duration<double>;
  std::condition_variable_any asked;
  std::unique_lock lock(mutex_);
  while (!asked.wait_for(lock, stop, kStageInterval, [&] { return stop.stop_requested(); })) {
    const auto now = std::chrono::steady_clock::now();
    const double wall = Seconds(now - made_).count(), stage = Seconds(now - begin_).count();
    if (stage_.empty() || stage < kQuietStage || !line_.Due(wall)) continue;
    line_.Show(fmt::format("{}: {:.0f} s", stage_, stage), wall);
  }
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
