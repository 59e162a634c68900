#include "components/framework/process_runner.h"

#include <poll.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "components/framework/clock.h"
#include "components/framework/inbox.h"
#include "components/framework/latency_histogram.h"
#include "components/framework/outbox.h"
#include "components/framework/run.h"
#include "components/framework/service_link.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kMillisecond = 1'000'000;
constexpr int64_t kHealthInterval = 100 * kMillisecond;
constexpr int64_t kAnnounceInterval = 50 * kMillisecond;  // before the start and after the end
constexpr int64_t kFirstRequest = 2 * kMillisecond;
constexpr int64_t kLastRequest = 50 * kMillisecond;
constexpr int kMaxSendFailures = 20;  // in a row
constexpr int kDrainBatch = 32;

int FindComponent(const Graph& graph, const std::string& name) {
  std::vector<std::string> names;
  for (int i = 0; i < graph.component_size(); ++i) {
    if (graph.component(i).name() == name) return i;
    names.push_back(graph.component(i).name());
  }
  throw ConfigError(fmt::format("graph {}: has no component '{}'; it has {}", graph.name(), name,
                                fmt::join(names, ", ")));
}

/// Decides which received messages a faulty network would have lost.
class FaultInjector {
 public:
  FaultInjector(double rate, uint64_t seed) : rate_(rate), state_(seed) {}
  bool Drop() {
    if (rate_ <= 0) return false;
    state_ += 0x9e3779b97f4a7c15u;
    uint64_t x = state_;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53 < rate_;
  }

 private:
  double rate_;
  uint64_t state_;
};

struct DataLink {
  DataLink(const std::string& url, int index, const std::string& name)
      : receiver(url), channel(index), channel_name(name) {}
  BusReceiver receiver;
  int channel;
  std::string channel_name;
  std::vector<Inbox*> inboxes;
  int64_t foreign = 0;  // packets of other channels on this port
};

struct BoundStage {
  struct BoundInput {
    Inbox* inbox;
    int channel;
  };
  const Stage* stage;
  std::vector<BoundInput> inputs;
  std::vector<Outbox*> outputs;
};

}  // namespace

class ProcessRunner::Impl {
 public:
  Impl(const RunSpec& spec, const std::string& name, const ComponentFactory& factory,
       const ProcessRunnerOptions& options);

  bool Run();
  const std::string& error() const { return error_; }

 private:
  bool Stopped() const {
    return stopped_ || (options_.stop != nullptr && *options_.stop != 0) || !error_.empty();
  }
  bool RunTicks();
  bool MayStart() const;
  void WaitForStart();
  void WaitForTime(int64_t time);
  bool StageReady(const BoundStage& stage) const;
  bool WaitForInputs(const BoundStage& stage);
  bool RunStage(const BoundStage& stage, const Tick& tick);
  void Ask(const BoundStage& stage);
  void ReportProgress();
  void End(int8_t state, std::string_view detail);
  void StayUntilStop();

  /// Handles what arrives until `deadline` (ns; the past: only what is there); returns after the
  /// first packets.
  void Poll(int64_t deadline, int batch);
  void Receive(DataLink& link, int batch);
  void ReceiveService(int batch);
  void OnControl(const run_control_t& control);
  void PublishHealth(int64_t now);
  void CountSend(bool sent);

  ProcessRunnerOptions options_;
  double period_;
  bool realtime_;
  int64_t num_ticks_;
  int64_t run_id_;
  int index_;
  SharedObjects shared_;
  ConfiguredComponent configured_;
  ServiceLink service_;
  FaultInjector faults_;
  std::vector<std::unique_ptr<Inbox>> inboxes_;
  std::vector<std::unique_ptr<Outbox>> outboxes_;
  std::vector<std::unique_ptr<DataLink>> links_;
  std::vector<BoundStage> stages_;
  std::vector<pollfd> poll_fds_;  // the service port, then links_
  bool is_source_ = false;
  bool must_report_ = false;
  struct Reporter {
    int32_t channel;  // as in run_control_t: component index, -1 the recorder
    int64_t tick;
  };
  std::vector<Reporter> reporters_;

  int64_t tick_ = 0;     // the one that runs
  int64_t arrival_ = 0;  // ns, of the last packets
  bool polled_ = false;  // in this tick
  int64_t next_health_ = 0;
  int send_failures_ = 0;
  bool started_ = false;
  bool stopped_ = false;
  int64_t resends_ = 0;
  int64_t dropped_ = 0;
  int64_t publish_errors_ = 0;
  LatencyHistogram latency_;
  std::string error_;
};

ProcessRunner::Impl::Impl(const RunSpec& spec, const std::string& name,
                          const ComponentFactory& factory, const ProcessRunnerOptions& options)
    : options_(options),
      period_(spec.tick_period()),
      realtime_(spec.realtime()),
      num_ticks_(spec.num_ticks()),
      run_id_(spec.run_id()),
      index_(FindComponent(spec.graph(), name)),
      configured_(ConfigureComponent(spec, index_, factory, &shared_)),
      service_(spec, name),
      faults_(spec.drop_rate(), InstanceSeed(spec.seed(), name + "/drops")) {
  const Graph& graph = spec.graph();
  if (!(period_ > 0)) throw ConfigError("run: tick_period must be greater than 0");
  CheckWiring(graph, index_, configured_.wiring);
  const ComponentInstance& instance = graph.component(index_);
  const auto channel_of = [&](const auto& connections, const std::string& port) {
    for (const Connection& connection : connections) {
      if (connection.port() != port) continue;
      for (int i = 0; i < graph.channel_size(); ++i) {
        if (graph.channel(i).name() == connection.channel()) return i;
      }
    }
    throw ConfigError(fmt::format("component {}: port {} is not connected to a channel of graph {}",
                                  name, port, graph.name()));
  };
  const Wiring& wiring = configured_.wiring;
  poll_fds_.push_back({service_.fd(), POLLIN, 0});
  std::vector<int> input_channels;
  for (InputPort* input : wiring.inputs()) {
    const int channel = channel_of(instance.input(), input->name());
    input_channels.push_back(channel);
    inboxes_.push_back(std::make_unique<Inbox>(input, run_id_));
    auto link = std::find_if(links_.begin(), links_.end(),
                             [&](const auto& l) { return l->channel == channel; });
    if (link == links_.end()) {
      links_.push_back(std::make_unique<DataLink>(ChannelUrl(spec, channel), channel,
                                                  graph.channel(channel).name()));
      poll_fds_.push_back({links_.back()->receiver.fd(), POLLIN, 0});
      link = links_.end() - 1;
    }
    (*link)->inboxes.push_back(inboxes_.back().get());
  }
  for (OutputPort* output : wiring.outputs()) {
    const int channel = channel_of(instance.output(), output->name());
    outboxes_.push_back(std::make_unique<Outbox>(output, channel, graph.channel(channel).name(),
                                                 ChannelUrl(spec, channel)));
  }
  for (const Stage& stage : wiring.stages()) {
    BoundStage bound{&stage, {}, {}};
    for (const InputPort* input : stage.inputs) {
      const auto k =
          static_cast<size_t>(std::find(wiring.inputs().begin(), wiring.inputs().end(), input) -
                              wiring.inputs().begin());
      bound.inputs.push_back({inboxes_[k].get(), input_channels[k]});
    }
    for (const OutputPort* output : stage.outputs) {
      const auto o =
          static_cast<size_t>(std::find(wiring.outputs().begin(), wiring.outputs().end(), output) -
                              wiring.outputs().begin());
      bound.outputs.push_back(outboxes_[o].get());
    }
    stages_.push_back(std::move(bound));
  }
  is_source_ = std::none_of(
      stages_[0].inputs.begin(), stages_[0].inputs.end(),
      [](const auto& input) { return input.inbox->port().kind() == InputKind::kSameTick; });
  must_report_ = MustReportProgress(graph, index_);
  if (is_source_) {
    for (const int reporter : ProgressReporters(graph, index_))
      reporters_.push_back({reporter, -1});
    if (options_.wait_for_recorder || spec.recorded()) reporters_.push_back({-1, -1});
  }
}

bool ProcessRunner::Impl::Run() {
  WaitForStart();
  if (!Stopped() && RunTicks()) StayUntilStop();
  return error_.empty();
}

void ProcessRunner::Impl::WaitForStart() {
  service_.health().state = health_t::STATE_READY;
  service_.health().tick = -1;
  while (!started_ && !Stopped()) Poll(NowNanoseconds() + kAnnounceInterval, kDrainBatch);
  service_.health().state = health_t::STATE_RUNNING;
  next_health_ = 0;  // at once: the launcher waits for it
}

/// True when the component has ended by itself.
bool ProcessRunner::Impl::RunTicks() {
  const int64_t start = NowNanoseconds();
  while (true) {
    polled_ = false;
    if (is_source_) {
      while (!MayStart() && !Stopped()) Poll(NowNanoseconds() + kAnnounceInterval, kDrainBatch);
      if (realtime_)
        WaitForTime(start + static_cast<int64_t>(static_cast<double>(tick_) * period_ * 1e9));
    }
    for (const auto& inbox : inboxes_) {
      if (inbox->port().kind() == InputKind::kSameTick) inbox->Want(tick_);
      if (inbox->port().kind() == InputKind::kPreviousTick)
        inbox->Want(std::max<int64_t>(0, tick_ - 1));
    }
    const Tick tick = MakeTick(tick_, period_);
    for (const BoundStage& stage : stages_) {
      if (!WaitForInputs(stage)) return false;
      if (!RunStage(stage, tick)) return true;
    }
    if (!polled_) Poll(0, kDrainBatch);
    service_.health().tick = tick.index;
    service_.health().utime = tick.utime;
    ++tick_;
    if (must_report_ && tick_ % kProgressInterval == 0) ReportProgress();
    const std::string_view finished = configured_.component->finished();
    if (!finished.empty()) {
      End(configured_.component->failed() ? health_t::STATE_FAILED : health_t::STATE_FINISHED,
          finished);
      return true;
    }
    if (num_ticks_ > 0 && tick_ >= num_ticks_) {
      End(health_t::STATE_FINISHED, "");
      return true;
    }
    if (Stopped()) return false;
  }
}

bool ProcessRunner::Impl::MayStart() const {
  return std::all_of(reporters_.begin(), reporters_.end(),
                     [&](const Reporter& reporter) { return tick_ - reporter.tick <= kMaxLead; });
}

void ProcessRunner::Impl::WaitForTime(int64_t time) {
  // Packets are handled until shortly before; the rest is slept through, for an absolute deadline.
  while (!Stopped() && NowNanoseconds() < time - kMillisecond / 5)
    Poll(time - kMillisecond / 5, kDrainBatch);
  const timespec deadline{time / 1'000'000'000, time % 1'000'000'000};
  while (!Stopped() && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) != 0) {
  }
}

bool ProcessRunner::Impl::StageReady(const BoundStage& stage) const {
  return std::all_of(
      stage.inputs.begin(), stage.inputs.end(), [&](const BoundStage::BoundInput& input) {
        return input.inbox->ready() ||
               (tick_ == 0 && input.inbox->port().kind() == InputKind::kPreviousTick);
      });
}

bool ProcessRunner::Impl::WaitForInputs(const BoundStage& stage) {
  arrival_ = NowNanoseconds();
  int64_t wait = kFirstRequest + (realtime_ ? static_cast<int64_t>(period_ * 1e9) : 0);
  int64_t next_request = arrival_ + wait;
  while (!StageReady(stage)) {
    if (Stopped()) return false;
    Poll(next_request, 1);
    if (arrival_ < next_request || StageReady(stage)) continue;
    Ask(stage);
    wait = std::min(2 * wait, kLastRequest);
    next_request = arrival_ + wait;
  }
  return true;
}

void ProcessRunner::Impl::Ask(const BoundStage& stage) {
  for (const BoundStage::BoundInput& input : stage.inputs) {
    const InputKind kind = input.inbox->port().kind();
    if (input.inbox->ready() || (tick_ == 0 && kind == InputKind::kPreviousTick)) continue;
    input.inbox->CountGap();
    CountSend(
        service_.SendControl(run_control_t::COMMAND_RESEND, input.inbox->wanted(), input.channel));
  }
}

bool ProcessRunner::Impl::RunStage(const BoundStage& bound, const Tick& tick) {
  for (const BoundStage::BoundInput& input : bound.inputs) {
    input.inbox->Show(tick.index == 0 && input.inbox->port().kind() == InputKind::kPreviousTick);
  }
  for (Outbox* outbox : bound.outputs) outbox->port().Stamp(run_id_, tick.index, tick.utime);
  bound.stage->run(tick);
  for (const BoundStage::BoundInput& input : bound.inputs) input.inbox->Hide();
  for (Outbox* outbox : bound.outputs) {
    if (!outbox->port().Finite()) {
      error_ = fmt::format("output {} is not finite at tick {}", outbox->port().name(), tick.index);
      End(health_t::STATE_FAILED, error_);
      return false;
    }
    CountSend(outbox->Send(tick.index));
  }
  latency_.Add(NowNanoseconds() - arrival_);
  return true;
}

void ProcessRunner::Impl::ReportProgress() {
  CountSend(service_.SendControl(run_control_t::COMMAND_RECORDED, tick_ - 1, index_));
}

void ProcessRunner::Impl::End(int8_t state, std::string_view detail) {
  service_.health().state = state;
  service_.SetDetail(detail);
  next_health_ = 0;
}

void ProcessRunner::Impl::StayUntilStop() {
  const auto stop_asked = [&] {
    return stopped_ || (options_.stop != nullptr && *options_.stop != 0);
  };
  while (!stop_asked()) Poll(NowNanoseconds() + kAnnounceInterval, kDrainBatch);
}

void ProcessRunner::Impl::Poll(int64_t deadline, int batch) {
  polled_ = true;
  int64_t now = NowNanoseconds();
  if (now >= next_health_) PublishHealth(now);
  const int64_t wait = std::max<int64_t>(0, std::min(deadline, next_health_) - now);
  const timespec timeout{wait / 1'000'000'000, wait % 1'000'000'000};
  const int ready = ppoll(poll_fds_.data(), poll_fds_.size(), &timeout, nullptr);
  arrival_ = NowNanoseconds();
  if (ready <= 0) return;  // a timeout or a signal
  for (size_t i = 1; i < poll_fds_.size(); ++i) {
    if (poll_fds_[i].revents != 0) Receive(*links_[i - 1], batch);
  }
  if (poll_fds_[0].revents != 0) ReceiveService(batch);
}

void ProcessRunner::Impl::Receive(DataLink& link, int batch) {
  BusReceiver::Packet packet;
  while (batch-- > 0 && link.receiver.Receive(&packet)) {
    if (packet.channel != link.channel_name) {
      if (packet.channel != "LCM_SELF_TEST") ++link.foreign;
    } else if (faults_.Drop()) {
      ++dropped_;
    } else {
      for (Inbox* inbox : link.inboxes) inbox->Offer(packet.data, packet.size);
    }
  }
}

void ProcessRunner::Impl::ReceiveService(int batch) {
  BusReceiver::Packet packet;
  run_control_t control;
  while (batch-- > 0 && service_.receiver().Receive(&packet)) {
    if (packet.channel != kControlChannel) {
      service_.filter().CheckHealth(packet);  // of no use here, but what is wrong is counted
    } else if (service_.filter().DecodeControl(packet, &control)) {
      OnControl(control);
    }
  }
}

void ProcessRunner::Impl::OnControl(const run_control_t& control) {
  switch (control.command) {
    case run_control_t::COMMAND_START:
      started_ = true;
      break;
    case run_control_t::COMMAND_STOP:
      stopped_ = true;
      break;
    case run_control_t::COMMAND_RESEND:
      for (const auto& outbox : outboxes_) {
        if (outbox->channel() == control.channel && outbox->Resend(control.tick)) ++resends_;
      }
      break;
    case run_control_t::COMMAND_RECORDED:
      for (Reporter& reporter : reporters_) {
        if (reporter.channel == control.channel && control.tick < tick_) {
          reporter.tick = std::max(reporter.tick, control.tick);
        }
      }
      break;
    default:
      break;
  }
}

void ProcessRunner::Impl::PublishHealth(int64_t now) {
  health_t& health = service_.health();
  const bool running = health.state == health_t::STATE_RUNNING;
  next_health_ = now + (running ? kHealthInterval : kAnnounceInterval);
  health.ticks_completed = tick_;
  health.messages_received = health.messages_duplicate = health.gaps = 0;
  health.messages_refused = service_.refused();
  for (const auto& inbox : inboxes_) {
    health.messages_received += inbox->counters().accepted();
    health.messages_refused += inbox->counters().refused();
    health.messages_duplicate += inbox->duplicates();
    health.gaps += inbox->gaps();
  }
  for (const auto& link : links_)
    health.messages_refused += link->foreign + link->receiver.malformed();
  health.messages_dropped = dropped_;
  health.resends = resends_;
  health.publish_errors = publish_errors_;
  health.latency_median = latency_.median();
  health.latency_p99 = latency_.p99();
  health.latency_max = latency_.max();
  std::ranges::copy(latency_.HalfOctaves(), health.latency_count);
  CountSend(service_.SendHealth());
  // Also covers a report that was lost.
  if (must_report_ && tick_ > 0) ReportProgress();
}

void ProcessRunner::Impl::CountSend(bool sent) {
  send_failures_ = sent ? 0 : send_failures_ + 1;
  publish_errors_ += sent ? 0 : 1;
  if (send_failures_ == kMaxSendFailures && error_.empty()) {
    error_ = "the bus does not send any more; is the network up? run: poise doctor";
  }
}

ProcessRunner::ProcessRunner(const RunSpec& spec, const std::string& name,
                             const ComponentFactory& factory, const ProcessRunnerOptions& options)
    : impl_(std::make_unique<Impl>(spec, name, factory, options)) {}
ProcessRunner::~ProcessRunner() = default;
bool ProcessRunner::Run() { return impl_->Run(); }
const std::string& ProcessRunner::error() const { return impl_->error(); }

}  // namespace poise
