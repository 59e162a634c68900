// A process's place on the service port: commands in and out, its health out.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/service_filter.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/graph.pb.h"
#include "poise/health_t.hpp"
#include "poise/run_control_t.hpp"

namespace poise {

/// Sends and checks run_control_t and health_t of one run. Does not allocate after construction,
/// except in SetDetail.
class ServiceLink {
 public:
  /// Throws BusError.
  ServiceLink(const RunSpec& spec, const std::string& component);

  int fd() const { return receiver_.fd(); }
  BusReceiver& receiver() { return receiver_; }
  /// Checks and decodes what the receiver has got, and counts what it refuses.
  ServiceFilter& filter() { return filter_; }
  int64_t refused() const { return filter_.refused() + receiver_.malformed(); }

  bool SendControl(int8_t command, int64_t tick, int32_t channel);
  /// Health as it is sent; state, counters and latencies are the caller's to fill in.
  health_t& health() { return health_; }
  void SetDetail(std::string_view detail);
  bool SendHealth();

 private:
  int64_t run_id_;
  BusSender sender_;
  BusReceiver receiver_;
  ServiceFilter filter_;
  std::string health_channel_;
  health_t health_{};
  run_control_t control_{};
  std::vector<uint8_t> control_bytes_;
  std::vector<uint8_t> health_bytes_;
};

}  // namespace poise
