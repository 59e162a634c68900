// One output of a component in a process: encodes, sends and sends again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/ports.h"

namespace poise {

/// Keeps the last kSentHistory messages to answer requests with the same bytes. All memory is taken
/// at construction.
class Outbox {
 public:
  /// Throws BusError.
  Outbox(OutputPort* port, int channel, std::string channel_name, const std::string& url);

  OutputPort& port() { return *port_; }
  int channel() const { return channel_; }
  /// Encodes the port's message of `tick` and sends it. False when that failed (the message is
  /// kept).
  bool Send(int64_t tick);
  /// Sends the message of `tick` again; false when it has not been sent yet, is no longer kept, or
  /// sending failed.
  bool Resend(int64_t tick);

 private:
  OutputPort* port_;
  int channel_;
  std::string channel_name_;
  BusSender sender_;
  size_t size_;
  std::vector<uint8_t> bytes_;
  std::vector<int64_t> ticks_;  // -1: empty
};

}  // namespace poise
