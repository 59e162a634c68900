// The launcher's side of a run: start, stop, and the health of its components.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.pb.h"
#include "poise/health_t.hpp"

namespace poise {

/// Sends commands and collects health. Not thread-safe.
class ControlClient {
 public:
  /// Watches the graph's components and `others` (e.g. {"recorder"}). `socket` must outlive this;
  /// nullptr: sends nothing. Throws BusError.
  ControlClient(const RunSpec& spec, const RunSocket* socket,
                const std::vector<std::string>& others = {});
  ~ControlClient();

  /// Repeat SendStart until every state is beyond STATE_READY, SendStop until every process has
  /// gone. False when the system refused to send, or there is no socket.
  bool SendStart();
  bool SendStop();

  /// Handles what arrives within `timeout_ms`; returns after the first batch, or when one of
  /// `wake_fds` is readable.
  void Spin(int timeout_ms, std::span<const int> wake_fds = {});

  struct Status {
    bool seen = false;
    int64_t last_seen = 0;  ///< ns, steady clock
    health_t health;        ///< valid when seen
  };
  /// What was heard of each component, by name; every watched one is there from the start.
  const std::map<std::string, Status>& statuses() const { return statuses_; }
  /// True when every watched process has been seen in a state >= `state` (health_t::STATE_*).
  bool AllReached(int8_t state) const;
  /// Packets refused on the service port.
  int64_t refused() const;

 private:
  struct Links;
  int64_t run_id_;
  std::map<std::string, Status> statuses_;
  std::unique_ptr<Links> links_;
};

}  // namespace poise
