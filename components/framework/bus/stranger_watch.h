// What others than a run's own processes send to it: emergency stops are heard, all else is refused
// and counted.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"

namespace poise {

/// True for the channel on which an emergency stop comes from outside the graph. Whoever sees a
/// robot must be able to stop it: of this one, readers take others' packets too if OnlyStops.
bool TakesStopsOfAll(const Channel& channel);
/// True for an emergency stop that asks for nothing else: no end of a stop.
bool OnlyStops(const BusReceiver::Packet& packet);

/// Packets from one source that a channel's readers have refused for their source.
struct Stranger {
  std::string channel;  ///< of the graph, or "CONTROL", "MIRROR": the run's other two ports
  PacketSource source;
  int64_t packets = 0;
};

/// Hears on the ports of a run all that its receivers do not. Not thread-safe.
class StrangerWatch {
 public:
  enum class Ports { kProcesses, kMirror };
  /// Watches the ports that processes listen to, or the public one. Throws BusError.
  StrangerWatch(const RunSpec& spec, Ports ports);

  /// Counts what has come. True when anything has.
  bool Look();
  /// Strangers by channel and source, as they first came: at most kMostStrangers, and one more
  /// without a source that counts all others.
  const std::vector<Stranger>& strangers() const { return strangers_; }

  static constexpr size_t kMostStrangers = 64;

 private:
  struct Ear {
    std::string channel;
    bool stops;  // are taken
    std::unique_ptr<BusReceiver> receiver;
  };
  void Count(const std::string& channel, const PacketSource& source);

  std::vector<Ear> ears_;
  std::vector<Stranger> strangers_;
};

/// "124 packets from outside the run: 120 to JOINT_COMMAND from 127.0.0.1:40123, ...", the most
/// first; empty when there are none.
std::string Describe(std::vector<Stranger> strangers);

}  // namespace poise
