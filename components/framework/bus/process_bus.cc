#include "components/framework/bus/process_bus.h"

#include <algorithm>

#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {

bool FaultInjector::Drop() {
  if (rate_ <= 0) return false;
  state_ += 0x9e3779b97f4a7c15u;
  uint64_t x = state_;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53 < rate_;
}

ProcessBus::ProcessBus(const RunSpec& spec, int index, ConfiguredComponent* component, Join join,
                       bool open)
    : service_(spec, component->name),
      faults_(spec.drop_rate(), InstanceSeed(spec.seed(), component->name + "/drops")) {
  const Graph& graph = spec.graph();
  const ComponentInstance& instance = graph.component(index);
  const auto channel_of = [&](const auto& connections, const std::string& port) {
    for (const Connection& connection : connections) {
      if (connection.port() != port) continue;
      for (int i = 0; i < graph.channel_size(); ++i) {
        if (graph.channel(i).name() == connection.channel()) return i;
      }
    }
    throw ConfigError(fmt::format("component {}: port {} is not connected to a channel of graph {}",
                                  component->name, port, graph.name()));
  };
  const Wiring& wiring = component->wiring;
  std::vector<int> input_channels;
  for (InputPort* input : wiring.inputs()) {
    const int channel = channel_of(instance.input(), input->name());
    input_channels.push_back(channel);
    inboxes_.push_back(std::make_unique<Inbox>(input, spec.run_id(), join));
    auto link = std::find_if(links_.begin(), links_.end(),
                             [&](const auto& l) { return l->channel == channel; });
    if (link == links_.end()) {
      links_.push_back(std::make_unique<DataLink>());
      links_.back()->url = ChannelUrl(spec, channel);
      links_.back()->channel = channel;
      links_.back()->channel_name = graph.channel(channel).name();
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
  poll_fds_.push_back({service_.fd(), POLLIN, 0});
  for (size_t i = 0; i < links_.size(); ++i) poll_fds_.push_back({-1, POLLIN, 0});
  if (open) OpenInputs();
}

void ProcessBus::OpenInputs() {
  for (size_t i = 0; i < links_.size(); ++i) {
    links_[i]->receiver.emplace(links_[i]->url);
    poll_fds_[i + 1].fd = links_[i]->receiver->fd();
  }
}

void ProcessBus::AttachDevices(const std::vector<Device*>& devices, int64_t interval) {
  devices_ = devices;
  device_interval_ = interval;
  poll_fds_.resize(1 + links_.size());
  for (const Device* device : devices_) poll_fds_.push_back({device->fd(), POLLIN, 0});
}

int64_t ProcessBus::Poll(int64_t deadline, int batch) {
  int64_t now = NowNanoseconds();
  if (!devices_.empty()) deadline = std::min(deadline, next_serve_);
  const int64_t wait = std::max<int64_t>(0, deadline - now);
  const timespec timeout{wait / 1'000'000'000, wait % 1'000'000'000};
  const int ready = ppoll(poll_fds_.data(), poll_fds_.size(), &timeout, nullptr);
  now = NowNanoseconds();
  const size_t first_device = 1 + links_.size();
  const bool serve_all = now >= next_serve_;
  for (size_t i = 0; i < devices_.size(); ++i) {
    if (serve_all || (ready > 0 && poll_fds_[first_device + i].revents != 0)) devices_[i]->Serve();
  }
  if (serve_all) next_serve_ = now + device_interval_;
  if (ready <= 0) return now;  // a timeout or a signal
  for (size_t i = 0; i < links_.size(); ++i) {
    if (poll_fds_[i + 1].revents != 0) Receive(*links_[i], batch);
  }
  if (poll_fds_[0].revents != 0) ReceiveService(batch);
  return now;
}

void ProcessBus::Receive(DataLink& link, int batch) {
  BusReceiver::Packet packet;
  while (batch-- > 0 && link.receiver->Receive(&packet)) {
    if (packet.channel != link.channel_name) {
      if (packet.channel != "LCM_SELF_TEST") ++link.foreign;
    } else if (faults_.Drop()) {
      ++dropped_;
    } else {
      for (Inbox* inbox : link.inboxes) inbox->Offer(packet.data, packet.size);
    }
  }
}

void ProcessBus::ReceiveService(int batch) {
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

void ProcessBus::OnControl(const run_control_t& control) {
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

bool ProcessBus::NearEnough(int64_t tick) const {
  return std::all_of(reporters_.begin(), reporters_.end(),
                     [&](const Reporter& reporter) { return tick - reporter.tick <= kMaxLead; });
}

void ProcessBus::Ask(const BoundStage& stage, int64_t tick) {
  for (const BoundStage::BoundInput& input : stage.inputs) {
    const InputKind kind = input.inbox->port().kind();
    if (input.inbox->ready() || (tick == 0 && kind == InputKind::kPreviousTick)) continue;
    input.inbox->CountGap();
    CountSend(SendControl(run_control_t::COMMAND_RESEND, input.inbox->wanted(), input.channel));
  }
}

void ProcessBus::CountSend(bool sent) {
  if (!broken()) send_failures_ = sent ? 0 : send_failures_ + 1;
  publish_errors_ += sent ? 0 : 1;
}

void ProcessBus::SendHealth() {
  health_t& health = service_.health();
  health.messages_received = health.messages_duplicate = health.gaps = 0;
  health.messages_refused = service_.refused();
  for (const auto& inbox : inboxes_) {
    health.messages_received += inbox->counters().accepted();
    health.messages_refused += inbox->counters().refused();
    health.messages_duplicate += inbox->duplicates();
    health.gaps += inbox->gaps();
  }
  for (const auto& link : links_) {
    health.messages_refused += link->foreign + (link->receiver ? link->receiver->malformed() : 0);
  }
  health.messages_dropped = dropped_;
  health.resends = resends_;
  health.publish_errors = publish_errors_;
  CountSend(service_.SendHealth());
}

}  // namespace poise
