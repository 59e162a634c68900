// Checks of what arrives on the service port, before anything acts on it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/graph.pb.h"
#include "poise/health_t.hpp"
#include "poise/run_control_t.hpp"

namespace poise {

/// Accepts CONTROL and the HEALTH_* of a run's processes (its components, the recorder, `others`)
/// and counts all else as refused. Only DecodeHealth allocates.
class ServiceFilter {
 public:
  explicit ServiceFilter(const RunSpec& spec, const std::vector<std::string>& others = {});

  /// A packet of channel CONTROL. False when it is refused.
  bool DecodeControl(const BusReceiver::Packet& packet, run_control_t* control);
  /// A packet of any other channel: false when it is no health of this run's processes. It does not
  /// look at the component's name inside.
  bool CheckHealth(const BusReceiver::Packet& packet);
  /// CheckHealth, and the component inside must be the channel's: false, refused otherwise.
  bool DecodeHealth(const BusReceiver::Packet& packet, health_t* health);
  int64_t refused() const { return refused_; }

 private:
  bool IsHealth(const BusReceiver::Packet& packet) const;
  bool CountUnless(bool good, const BusReceiver::Packet& packet);

  int64_t run_id_;
  PacketFilter control_filter_;
  std::map<std::string, std::string, std::less<>> name_of_channel_;
  int64_t refused_ = 0;
};

}  // namespace poise
