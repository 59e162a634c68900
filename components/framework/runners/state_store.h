// StateStore: a component's state after each tick, in memory that outlives its process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "components/framework/file_descriptor.h"

namespace poise {

/// A mapped file that the launcher makes and the processes of one component share, one after the
/// other. Two copies in turn: a writer that dies in the middle leaves the one before. Save neither
/// allocates nor enters the system.
class StateStore {
 public:
  static constexpr size_t kCapacity = 1 << 16;  ///< bytes of a state

  /// Maps `path`. Throws std::system_error.
  explicit StateStore(const std::string& path);
  ~StateStore();
  StateStore(const StateStore&) = delete;
  StateStore& operator=(const StateStore&) = delete;

  /// A file for a StateStore that lives in memory alone. Another process opens it as
  /// /proc/PID/fd/N while the descriptor is kept. Throws std::system_error.
  static FileDescriptor MakeMemoryFile(const std::string& name);

  /// Where the state after `tick` is to be written, kCapacity bytes; Commit makes it the latest.
  std::span<uint8_t> Next();
  void Commit(int64_t tick, size_t size);

  /// Tick of the latest state; -1: none yet.
  int64_t tick() const;
  /// Latest state; empty: none yet.
  std::span<const uint8_t> latest() const;

  /// How often a fresh process has taken over.
  int32_t restarts() const;
  void CountRestart();
  /// The pid of a process that waits to take over; 0: none is ready.
  int32_t standby() const;
  void set_standby(int32_t pid);

 private:
  struct Layout;
  Layout* layout_ = nullptr;
};

}  // namespace poise
