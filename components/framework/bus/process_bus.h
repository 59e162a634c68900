// ProcessBus: one process's side of the bus: its components' inputs, outputs, commands, devices and
// health.
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
#include "components/framework/bus/owned_message.h"
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

/// Binds the ports of a process's components to the channels of its graph, and to each other where
/// one reads what another writes: such messages stay in memory. After construction nothing
/// allocates, throws or locks.
class ProcessBus {
 public:
  /// `components`: all that run in `process`; they and `socket` must outlive this. With `open`
  /// false nothing is received but on the service port, until OpenInputs. Throws BusError or
  /// ConfigError.
  ProcessBus(const RunSpec& spec, const RunSocket& socket, const std::string& process,
             std::vector<ConfiguredComponent>* components, Join join, bool open);

  /// Opens the input channels (a process that takes over hears nothing of what came before).
  /// Throws BusError.
  void OpenInputs();

  struct BoundStage {
    struct BoundInput {
      Inbox* inbox;
      int channel;
    };
    /// Written by a component of this process, in this tick or the one before.
    struct LocalInput {
      InputPort* port;
      const void* message;
    };
    size_t component;  ///< among those of this process
    const Stage* stage;
    std::vector<BoundInput> inputs;
    std::vector<LocalInput> locals;
    std::vector<Outbox*> outputs;
  };
  /// In the tick's order.
  const std::vector<BoundStage>& stages() const { return stages_; }
  const std::vector<std::unique_ptr<Inbox>>& inboxes() const { return inboxes_; }
  /// True when a component reads what another of this process wrote in the tick before.
  bool has_local_delay() const { return !delayed_.empty(); }

  /// Handles what arrives until `deadline` (ns; the past: only what is there); returns after the
  /// first packets, `batch` at most a channel. Serves devices when they are readable and at least
  /// every device interval. Returns the time at which the wait ended, ns.
  int64_t Poll(int64_t deadline, int batch);
  /// Devices to serve from now on; `interval` in ns. Allocates.
  void AttachDevices(const std::vector<Device*>& devices, int64_t interval);

  /// Sends the message of `tick` at once when a component of another process waits for it; else
  /// with the next SendRest, before the port's message changes.
  void Send(Outbox* outbox, int64_t tick);
  /// Sends what only the recorder and other listeners hear.
  void SendRest();
  /// Sends what components have answered to an operator's acts.
  void SendAnswers();
  /// Ends a tick: what its components wrote is now of the tick before.
  void KeepDelayed();

  /// Asks for the wanted messages of a stage that have not come.
  void Ask(const BoundStage& stage, int64_t tick);
  bool SendControl(int8_t command, int64_t tick, int32_t channel);

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

  size_t num_components() const { return counters_.size(); }
  health_t& health(size_t component) { return service_.health(component); }
  void SetDetail(size_t component, std::string_view detail) {
    service_.SetDetail(detail, component);
  }
  /// Fills in the counters of the bus and sends the health of each component. What concerns the
  /// process as a whole is its first component's.
  void SendHealth();

 private:
  static constexpr int kMaxSendFailures = 20;

  struct DataLink {
    std::string url;
    int channel;
    std::string channel_name;
    Origin origin;
    std::optional<BusReceiver> receiver;
    std::vector<Inbox*> inboxes;
    int64_t foreign = 0;  // packets of other channels on this port
  };
  struct Reporter {
    int32_t channel;  // as in run_control_t: component index, -1 the recorder
    int64_t tick;
  };
  struct Counters {
    int64_t resends = 0;
    int64_t dropped = 0;
    int64_t publish_errors = 0;
  };
  /// A message of the tick before, for readers in this process.
  struct Delayed {
    const InputPort* port;  // any reader: knows how to copy
    const OutputPort* output;
    OwnedMessage message;
  };
  struct Unsent {
    Outbox* outbox;
    int64_t tick;
  };

  void BindOutputs(const RunSpec& spec, const RunSocket& socket,
                   const std::vector<ConfiguredComponent>& components);
  void BindStages(const RunSpec& spec, size_t component, const ConfiguredComponent& configured);
  void BindInput(const RunSpec& spec, const ComponentInstance& instance, InputPort* input,
                 BoundStage* stage);
  Inbox* InboxOf(const RunSpec& spec, size_t component, int channel, InputPort* input);
  void Receive(DataLink& link, int batch);
  void ReceiveService(int batch);
  void OnControl(const run_control_t& control);
  void CountSend(bool sent, size_t component);

  Join join_;
  ServiceLink service_;
  FaultInjector faults_;
  std::vector<std::unique_ptr<Inbox>> inboxes_;
  std::vector<std::unique_ptr<Outbox>> outboxes_;
  std::vector<std::unique_ptr<DataLink>> links_;
  std::vector<Delayed> delayed_;
  std::vector<BoundStage> stages_;
  std::vector<ActInput*> acts_;
  std::optional<RunSender> answer_sender_;  // none: the graph has no channel for answers
  std::string answer_channel_;
  std::vector<uint8_t> answer_bytes_;
  std::vector<Unsent> unsent_;  // as many at most as there are outputs
  std::vector<Counters> counters_;
  std::vector<Device*> devices_;
  std::vector<pollfd> poll_fds_;  // the service port, then links_, then devices_
  std::vector<Reporter> reporters_;
  int64_t tick_ = 0;  // the one that runs
  int64_t device_interval_ = 0;
  int64_t next_serve_ = 0;
  int send_failures_ = 0;
  bool started_ = false;
  bool stopped_ = false;
};

}  // namespace poise
