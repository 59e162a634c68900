// Reads one channel of a run that goes on.
#pragma once

#include <cstdint>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.pb.h"
#include "components/framework/run.h"
#include "logging/channel_ticks.h"
#include "poise/message_traits.hpp"

namespace poise {

/// Index of the graph's first channel of a type; -1: it has none.
inline int FindChannelOfType(const Graph& graph, std::string_view type) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type) return i;
  }
  return -1;
}

/// The messages of type T of one channel, as they come; strangers are left out.
template <class T>
class ChannelTap {
 public:
  /// Throws BusError. `channel`: index of one of type T in the graph, whose counts are filled in.
  ChannelTap(const RunSpec& spec, int channel)
      : name_(spec.graph().channel(channel).name()),
        filter_(logging::ChannelFilter(spec, spec.graph().channel(channel))),
        receiver_(ChannelUrl(spec, channel), OfRun(spec)) {}

  int fd() const { return receiver_.fd(); }
  /// The next one that has arrived, if any; does not block.
  bool Next(T* message) {
    BusReceiver::Packet packet;
    while (receiver_.Receive(&packet)) {
      const int size = static_cast<int>(packet.size);
      if (packet.channel == name_ &&
          filter_.Check(packet.data, packet.size, 0, INT64_MAX) == PacketVerdict::kAccepted &&
          message->decode(packet.data, 0, size) == size) {
        return true;
      }
    }
    return false;
  }

 private:
  std::string name_;
  PacketFilter filter_;
  BusReceiver receiver_;
};

}  // namespace poise
