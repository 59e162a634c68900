// ProcessBus: one process's side of the bus: its inputs, outputs, commands, devices and health.
#pragma once

#include <poll.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/inbox.h"
#include "components/framework/bus/outbox.h"
#include "components/framework/bus/service_link.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/graph.h"

namespace poise {

/// Decides which received messages a faulty network would have lost.
class FaultInjector {
 public:
  FaultInjector(double rate, uint64_t seed) : rate_(rate), state_(seed) {}
  bool Drop();

 private:
  double rate_;
  uint64_t state_;
};

/// Binds a configured component's ports to the channels of its graph. After construction nothing
/// allocates, throws or locks.
class ProcessBus {
 public:
  /// `component` must outlive this. With `open` false nothing is received but on the service port,
  /// until OpenInputs. Throws BusError or ConfigError.
  ProcessBus(const RunSpec& spec, int index, ConfiguredComponent* component, Join join, bool open);

  /// Opens the input channels (a process that takes over hears nothing of what came before).
  /// Throws BusError.
  void OpenInputs();

  struct BoundStage {
    struct BoundInput {
      Inbox* inbox;
      int channel;
    };
    const Stage* stage;
    std::vector<BoundInput> inputs;
    std::vector<Outbox*> outputs;
  };
  const std::vector<BoundStage>& stages() const { return stages_; }
  const std::vector<std::unique_ptr<Inbox>>& inboxes() const { return inboxes_; }

  /// Handles what arrives until `deadline` (ns; the past: only what is there); returns after the
  /// first packets, `batch` at most a channel. Serves devices when they are readable and at least
  /// every device interval. Returns the time at which the wait ended, ns.
  int64_t Poll(int64_t deadline, int batch);
  /// Devices to serve from now on; `interval` in ns. Allocates.
  void AttachDevices(const std::vector<Device*>& devices, int64_t interval);

  /// Asks for the wanted messages of a stage that have not come.
  void Ask(const BoundStage& stage, int64_t tick);
  void CountSend(bool sent);
  bool SendControl(int8_t command, int64_t tick, int32_t channel) {
    return service_.SendControl(command, tick, channel);
  }

  /// COMMAND_START, COMMAND_STOP seen.
  bool started() const { return started_; }
  bool stopped() const { return stopped_; }
  /// Too many messages in a row could not be sent.
  bool broken() const { return send_failures_ >= kMaxSendFailures; }

  /// Components and the recorder (-1) whose progress a tick source waits for.
  void WaitFor(int32_t reporter) { reporters_.push_back({reporter, -1}); }
  /// True when all of them are less than kMaxLead ticks behind `tick`.
  bool NearEnough(int64_t tick) const;
  void set_tick(int64_t tick) { tick_ = tick; }

  health_t& health() { return service_.health(); }
  void SetDetail(std::string_view detail) { service_.SetDetail(detail); }
  /// Fills in the counters of the bus and sends.
  void SendHealth();

 private:
  static constexpr int kMaxSendFailures = 20;

  struct DataLink {
    std::string url;
    int channel;
    std::string channel_name;
    std::optional<BusReceiver> receiver;
    std::vector<Inbox*> inboxes;
    int64_t foreign = 0;  // packets of other channels on this port
  };
  struct Reporter {
    int32_t channel;  // as in run_control_t: component index, -1 the recorder
    int64_t tick;
  };

  void Receive(DataLink& link, int batch);
  void ReceiveService(int batch);
  void OnControl(const run_control_t& control);

  ServiceLink service_;
  FaultInjector faults_;
  std::vector<std::unique_ptr<Inbox>> inboxes_;
  std::vector<std::unique_ptr<Outbox>> outboxes_;
  std::vector<std::unique_ptr<DataLink>> links_;
  std::vector<BoundStage> stages_;
  std::vector<Device*> devices_;
  std::vector<pollfd> poll_fds_;  // the service port, then links_, then devices_
  std::vector<Reporter> reporters_;
  int64_t tick_ = 0;  // the one that runs
  int64_t device_interval_ = 0;
  int64_t next_serve_ = 0;
  int send_failures_ = 0;
  bool started_ = false;
  bool stopped_ = false;
  int64_t resends_ = 0;
  int64_t dropped_ = 0;
  int64_t publish_errors_ = 0;
};

}  // namespace poise
