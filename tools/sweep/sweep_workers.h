// Work spread over processes that are forked for one task each.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace poise {

/// Each task starts from this process's state as it is and leaves nothing behind, so that it gives
/// the same answer whatever ran before it, and its crash is its own. This process must have one
/// thread. The tasks' processes end with this one, and with this object.
class ForkedTasks {
 public:
  struct Result {
    int64_t id = 0;
    std::optional<std::string> answer;
    std::string problem;   ///< without an answer: how the process ended, and its last words
    bool crashed = false;  ///< it ended by a signal that programs send themselves, e.g. SIGSEGV
  };

  explicit ForkedTasks(int at_once) : at_once_(at_once) {}
  ~ForkedTasks();
  ForkedTasks(const ForkedTasks&) = delete;
  ForkedTasks& operator=(const ForkedTasks&) = delete;

  int running() const { return static_cast<int>(tasks_.size()); }
  bool full() const { return running() >= at_once_; }
  /// `work` gives the answer; what it throws is its problem. Precondition: not full(). Throws
  /// std::system_error.
  void Start(int64_t id, const std::function<std::string()>& work);
  /// Those that have ended, after waiting at most `milliseconds` for the first one.
  std::vector<Result> Wait(int milliseconds);

 private:
  struct Task {
    int64_t id = 0;
    pid_t pid = -1;
    int pipe = -1;
    std::string text;
  };
  static Result Finish(Task* task);

  int at_once_;
  std::vector<Task> tasks_;
};

}  // namespace poise
