// Work spread over processes that are forked for one task each.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/runners/run_position.h"
#include "tools/cli/stall_watch.h"

namespace poise {

/// Where a run was when it ended before its time.
struct RunPlace {
  std::string component, stage;  ///< empty: in none
  double time = 0;               ///< s, of the scenario
};

/// What a task shows its owner while it works, in memory that they share.
class TaskStatus {
 public:
  /// Has its owner wait without an end: whoever works for the task watches itself.
  void SetWatchedElsewhere() { elsewhere_.store(true); }
  /// Stages by their index in `position`, as many as there is room for; period in s, lead in ticks.
  void SetRun(const std::vector<std::pair<std::string, std::string>>& stages, double period,
              int64_t lead);
  /// Tells that the task goes on, where no ticks do.
  void Step() { steps_.fetch_add(1); }
  RunPosition* position() { return &position_; }
  /// Tells that the work has given its answer or thrown: a process that ends before was ended by
  /// what it ran.
  void SetReturned() { returned_.store(true); }
  bool returned() const { return returned_.load(); }

  bool InStage() const { return position_.stage.load() != RunPosition::kNoStage; }
  RunPlace Place() const;
  /// ns, for how long it has stood still, if that is longer than it may; else 0. `now`: ns.
  int64_t Hangs(StallWatch* watch, int64_t now) const;

 private:
  static constexpr size_t kRoom = 16384;  // bytes

  RunPosition position_;
  std::atomic<bool> elsewhere_{false}, returned_{false};
  std::atomic<int64_t> steps_{0};
  std::atomic<double> period_{0};
  std::atomic<int64_t> lead_{0};
  char names_[kRoom] = {};  // component, stage, component, ..., each ended by a zero
};

/// Each task starts from this process's state as it is and leaves nothing behind, so that it gives
/// the same answer whatever ran before it, and its crash is its own. This process must have one
/// thread. The tasks' processes end with this one, and with this object.
class ForkedTasks {
 public:
  struct Result {
    int64_t id = 0;
    std::optional<std::string> answer;
    std::string problem;   ///< without an answer: how the process ended, and its last words
    bool crashed = false;  ///< a signal, exit() in its work or an exception of a stage ended it
    bool hung = false;     ///< it stood still and was ended
    RunPlace place;        ///< where it was, of one that crashed or hung
  };

  explicit ForkedTasks(int at_once) : at_once_(at_once) {}
  ~ForkedTasks();
  ForkedTasks(const ForkedTasks&) = delete;
  ForkedTasks& operator=(const ForkedTasks&) = delete;

  int running() const { return static_cast<int>(tasks_.size()); }
  bool full() const { return running() >= at_once_; }
  /// `work` gives the answer; what it throws is its problem, and outside the stages no crash.
  /// Precondition: not full(). Throws std::system_error.
  void Start(int64_t id, const std::function<std::string(TaskStatus*)>& work);
  /// Waits at most `milliseconds` for the first one that ends. Returns those that have ended, and
  /// those that hang, which it ends.
  std::vector<Result> Wait(int milliseconds);

 private:
  struct Task {
    int64_t id = 0;
    pid_t pid = -1;
    int pipe = -1;
    std::string text;
    TaskStatus* status = nullptr;  // shared memory
    StallWatch watch;
  };
  static Result Finish(Task* task);

  int at_once_;
  std::vector<Task> tasks_;
};

}  // namespace poise
