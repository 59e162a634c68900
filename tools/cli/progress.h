// Progress on the terminal.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <thread>

namespace poise {

/// One line that rewrites itself on a terminal; elsewhere a line every few seconds.
class StatusLine {
 public:
  /// Quiet: shows nothing.
  explicit StatusLine(bool quiet);
  /// True when it is time to show again. `wall`: s since the start.
  bool Due(double wall) const { return !quiet_ && wall >= next_; }
  void Show(const std::string& text, double wall);
  /// Removes the line from a terminal.
  void Clear();

 private:
  bool quiet_;
  bool terminal_;
  bool shown_ = false;
  double next_;  // wall time from which to show again
};

/// What a long piece of work is at, and for how long: said by a thread of its own from the first
/// second of a stage on. Whoever prints ends the stage first.
class StageLine {
 public:
  explicit StageLine(bool quiet);
  ~StageLine() { End(); }
  StageLine(const StageLine&) = delete;
  StageLine& operator=(const StageLine&) = delete;

  /// Ends the stage before it.
  void Begin(const std::string& stage);
  /// Removes the line; nothing is shown until the next Begin.
  void End();

 private:
  void Run(const std::stop_token& stop);

  std::mutex mutex_;
  StatusLine line_;
  std::string stage_;  // empty: none
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point made_;
  std::jthread thread_;
};

class Progress {
 public:
  /// `duration`: s of the scenario; `lead`: s before it. Quiet: shows nothing.
  Progress(double duration, bool quiet, double lead = 0)
      : duration_(duration), lead_(lead), line_(quiet) {}
  /// The scenario's time (negative: the run's lead) and wall time since the start, s. Cheap: shows
  /// only when it is time to.
  void Show(double time, double wall);
  void Clear() { line_.Clear(); }

 private:
  double duration_, lead_;
  StatusLine line_;
};

}  // namespace poise
