// Serves the page of a run in progress and its ticks to browsers on this machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "tools/live/tick_ring.h"

namespace poise {

/// HTTP on 127.0.0.1: GET / is the page, /stream a WebSocket (docs/report-format.md). Requests that
/// name another host or come from another origin are refused. All that is received is bounded in
/// size and time, and so is what waits to be sent: one batch a client; who takes none for 5 s is
/// dropped. Runs on the caller's thread, no error of a client throws.
class ViewServer {
 public:
  /// `port` 0: a free one. `ring` must outlive the server. Throws ConfigError when the port cannot
  /// be had.
  ViewServer(int port, std::string page, const TickRing* ring);
  ~ViewServer();

  int port() const;
  /// Sends, receives and accepts for this long.
  void RunFor(std::chrono::milliseconds duration);
  /// Sends each client the ticks that it lacks. To be called at the rate of the pictures.
  void SendTicks();
  /// What every client is told first, and again when it changes.
  void SetState(std::string json);
  /// A further text for every client, likewise; none until it is set.
  void SetStatus(std::string json);
  /// Clients that took nothing for too long.
  int64_t dropped() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace poise
