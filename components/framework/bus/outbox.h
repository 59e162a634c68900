// One output of a component in a process: encodes, sends and sends again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/ports.h"

namespace poise {

/// Keeps the last kSentHistory messages to answer requests with the same bytes. All memory is taken
/// at construction.
class Outbox {
 public:
  /// `component`: whose port it is, among those of its process. `awaited`: a component of another
  /// process reads the channel.
  Outbox(OutputPort* port, size_t component, int channel, std::string channel_name,
         RunSender sender, bool awaited);

  OutputPort& port() { return *port_; }
  size_t component() const { return component_; }
  int channel() const { return channel_; }
  bool awaited() const { return awaited_; }
  /// Encodes the port's message of `tick` and sends it. False when that failed (the message is
  /// kept).
  bool Send(int64_t tick);
  /// Sends the message of `tick` again; false when it has not been sent yet, is no longer kept, or
  /// sending failed.
  bool Resend(int64_t tick);

 private:
  OutputPort* port_;
  size_t component_;
  int channel_;
  bool awaited_;
  std::string channel_name_;
  RunSender sender_;
  size_t size_;
  std::vector<uint8_t> bytes_;
  std::vector<int64_t> ticks_;  // -1: empty
};

}  // namespace poise
