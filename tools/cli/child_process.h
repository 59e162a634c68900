// A child process with its output in a file.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace poise {

/// What a process's first thread had of the processors; zero where the system does not tell, or it
/// has ended.
struct ProcessorTime {
  int64_t used = 0;    ///< ns
  int64_t waited = 0;  ///< ns that it was ready to run and had to wait, the present wait aside
  bool ready = false;  ///< it runs, or waits for a processor
};

/// Starts on construction, in a process group of its own; ends with this process (SIGTERM) and with
/// this object (SIGKILL). Not thread-safe: the thread that starts it must outlive it.
class ChildProcess {
 public:
  /// `command[0]` is the program's path. Throws std::system_error when the file or the process
  /// cannot be made; a program that cannot be executed exits with 127 and says so in its log.
  /// `kept`: an open descriptor that the program gets under the same number; -1: none.
  ChildProcess(std::string name, const std::vector<std::string>& command, std::string log_path,
               int kept = -1);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  const std::string& name() const { return name_; }
  const std::string& log_path() const { return log_path_; }
  pid_t pid() const { return pid_; }
  /// Polls; true once the process has ended.
  bool ended();
  /// True when it ended by itself with exit code 0. Precondition: ended().
  bool succeeded() const;
  /// "exited with code 3", "was killed by signal 9 (Killed)". Precondition: ended().
  std::string HowItEnded() const;
  ProcessorTime processor_time() const;
  /// Sends a signal to the whole process group; nothing when it has ended.
  void Signal(int signal);

 private:
  std::string name_;
  std::string log_path_;
  pid_t pid_ = -1;
  bool ended_ = false;
  int status_ = 0;
};

/// The last `count` non-empty lines of a file; empty when there is none.
std::vector<std::string> LastLines(const std::string& path, size_t count);

}  // namespace poise
