// A process of the run, and one more that waits to take its place.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/runners/state_store.h"
#include "tools/cli/child_process.h"

namespace poise {

/// With `restart` a second, configured process stands by; when the first dies it takes over within
/// a millisecond or two, with the state of the last tick (StateStore), and another one stands by.
class ComponentProcess {
 public:
  /// Starts. `command[0]` is the program's path; `log_path` gets its output, a successor's goes to
  /// log_path with a number. Each process gets `socket`, which must outlive this, and --socket.
  /// `components`: those that it runs, empty: the one of its name. Throws std::system_error.
  ComponentProcess(std::string name, std::vector<std::string> command, std::string log_path,
                   bool restart, const RunSocket& socket, std::vector<std::string> components = {});

  /// Looks after it: lets the successor take over when the process has died. False when it has
  /// ended for good: it is not to be restarted, it and its successors died more than 5 times within
  /// 2 s, or none became ready within 5 s, what it waited for a processor aside. `now`: ns.
  bool Alive(int64_t now);
  /// The successor can take over at once; true without one.
  bool StandbyReady() const;
  /// From now on an end is no reason for a successor; the one that stands by is ended.
  void StopRestarts();

  ChildProcess& process() { return *process_; }
  const std::string& name() const { return name_; }
  /// The components that it runs, by their names in the graph; of the recorder its own name.
  const std::vector<std::string>& components() const { return components_; }
  bool restarts() const { return restart_; }
  int32_t takeovers() const { return takeovers_; }
  /// Memory that the process has in RAM now, bytes; 0 when it has none any more.
  int64_t ResidentBytes() const;
  /// Becomes readable when the process ends.
  int fd() const { return pidfd_; }

 private:
  void StartSpare();
  /// False: too many of late.
  bool NoteDeath(int64_t now);
  void Watch();

  std::string name_;
  std::vector<std::string> command_;
  std::string log_path_;
  bool restart_;
  int socket_;
  std::vector<std::string> components_;
  FileDescriptor memory_fd_;
  std::unique_ptr<StateStore> store_;
  std::unique_ptr<ChildProcess> process_, spare_;
  FileDescriptor pidfd_;
  int started_ = 0;  // processes so far
  int32_t takeovers_ = 0;
  std::deque<int64_t> deaths_;  // ns, of the last 2 s
  int64_t waiting_since_ = 0;   // for a successor that is not ready
};

}  // namespace poise
