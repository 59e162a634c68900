// Serves topics over the WebSocket protocol of Foxglove (foxglove.websocket.v1) on this machine.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/foxglove/scene_topics.h"

namespace poise {

/// On 127.0.0.1, for programs of this machine and for pages of the origins below; clients listen
/// and publish nothing. All that is received and all that waits is bounded. Runs on the caller's
/// thread, no error of a client throws.
class FoxgloveServer {
 public:
  /// `origins`: of pages that may connect besides those of this machine and of Foxglove itself.
  /// Throws ConfigError when the port cannot be had.
  FoxgloveServer(int port, const std::string& name, const std::vector<SceneTopic>& topics,
                 std::vector<std::string> origins);
  ~FoxgloveServer();

  int port() const;
  /// Sends, receives and accepts what can be without waiting.
  void Poll();
  /// Whether anybody listens to a topic, or its last message is kept.
  bool Wants(size_t topic) const;
  /// `time` in ns. Who lags behind misses it.
  void Send(size_t topic, uint64_t time, std::string message);
  /// The run's time, ns.
  void SendTime(uint64_t time);
  /// Messages that clients, gone ones too, were too slow for.
  int64_t dropped() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace poise
