// A process's place on the service port: commands in and out, the health of its components out.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/bus/service_filter.h"
#include "components/framework/graph.pb.h"
#include "poise/health_t.hpp"
#include "poise/run_control_t.hpp"

namespace poise {

/// Sends and checks run_control_t and health_t of one run. Does not allocate after construction,
/// except in SetDetail.
class ServiceLink {
 public:
  /// `components`: those of this process, one at least. Throws BusError.
  ServiceLink(const RunSpec& spec, const RunSocket& socket,
              const std::vector<std::string>& components);

  int fd() const { return receiver_.fd(); }
  BusReceiver& receiver() { return receiver_; }
  /// Checks and decodes what the receiver has got, and counts what it refuses.
  ServiceFilter& filter() { return filter_; }
  int64_t refused() const { return filter_.refused() + receiver_.malformed(); }

  bool SendControl(int8_t command, int64_t tick, int32_t channel);
  /// Health of a component as it is sent; state, counters and latencies are the caller's to fill
  /// in.
  health_t& health(size_t component = 0) { return reports_[component].health; }
  void SetDetail(std::string_view detail, size_t component = 0);
  bool SendHealth(size_t component = 0);

 private:
  struct Report {
    std::string channel;
    health_t health{};
    std::vector<uint8_t> bytes;
  };

  int64_t run_id_;
  RunSender sender_;
  BusReceiver receiver_;
  ServiceFilter filter_;
  std::vector<Report> reports_;
  run_control_t control_{};
  std::vector<uint8_t> control_bytes_;
};

}  // namespace poise
