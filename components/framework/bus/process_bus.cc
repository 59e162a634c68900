#include "components/framework/bus/process_bus.h"

#include <algorithm>
#include <numeric>

#include "components/framework/bus/stranger_watch.h"
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

namespace {

std::vector<std::string> NamesOf(const std::vector<ConfiguredComponent>& components) {
  std::vector<std::string> names;
  for (const ConfiguredComponent& component : components) names.push_back(component.name);
  return names;
}

/// Index of the channel that a port is connected to.
int ChannelOf(const Graph& graph, const std::string& component,
              const google::protobuf::RepeatedPtrField<Connection>& connections,
              const std::string& port) {
  for (const Connection& connection : connections) {
    if (connection.port() != port) continue;
    for (int i = 0; i < graph.channel_size(); ++i) {
      if (graph.channel(i).name() == connection.channel()) return i;
    }
  }
  throw ConfigError(fmt::format("component {}: port {} is not connected to a channel of graph {}",
                                component, port, graph.name()));
}

/// True when a component outside `process` reads the channel.
bool Awaited(const Graph& graph, const std::string& process, const std::string& channel) {
  return std::ranges::any_of(graph.component(), [&](const ComponentInstance& instance) {
    return ProcessOf(instance) != process &&
           std::ranges::any_of(instance.input(), [&](const Connection& connection) {
             return connection.channel() == channel;
           });
  });
}

}  // namespace

ProcessBus::ProcessBus(const RunSpec& spec, const RunSocket& socket, const std::string& process,
                       std::vector<ConfiguredComponent>* components, Join join, bool open)
    : join_(join),
      service_(spec, socket, NamesOf(*components)),
      faults_(spec.drop_rate(), InstanceSeed(spec.seed(), process + "/drops")),
      counters_(components->size()) {
  BindOutputs(spec, socket, *components);
  std::vector<int> places;  // of stages_, in the tick
  for (size_t i = 0; i < components->size(); ++i) {
    const ConfiguredComponent& configured = (*components)[i];
    const ComponentInstance& instance = spec.graph().component(configured.index);
    const size_t count = configured.wiring.stages().size();
    if (components->size() == 1) {
      for (size_t s = 0; s < count; ++s) places.push_back(static_cast<int>(s));
    } else if (static_cast<size_t>(instance.stage_place_size()) == count) {
      places.insert(places.end(), instance.stage_place().begin(), instance.stage_place().end());
    } else {
      throw ConfigError(fmt::format(
          "component {}: the run gives the places of {} of its {} stages; fill them in from the "
          "checked graph",
          configured.name, instance.stage_place_size(), count));
    }
    BindStages(spec, i, configured);
  }
  std::vector<size_t> order(stages_.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](size_t s) { return places[s]; });
  std::vector<BoundStage> sorted;
  for (const size_t s : order) sorted.push_back(std::move(stages_[s]));
  stages_ = std::move(sorted);
  poll_fds_.push_back({service_.fd(), POLLIN, 0});
  for (size_t i = 0; i < links_.size(); ++i) poll_fds_.push_back({-1, POLLIN, 0});
  for (int i = 0; i < spec.graph().channel_size() && !acts_.empty(); ++i) {
    const Channel& channel = spec.graph().channel(i);
    if (channel.type() != kAnswerType || !channel.external() || answer_sender_) continue;
    answer_sender_.emplace(socket, ChannelUrl(spec, i));
    answer_channel_ = channel.name();
    answer_bytes_.resize(static_cast<size_t>(operate::answer_t{}.getEncodedSize()));
  }
  if (open) OpenInputs();
}

void ProcessBus::BindOutputs(const RunSpec& spec, const RunSocket& socket,
                             const std::vector<ConfiguredComponent>& components) {
  const Graph& graph = spec.graph();
  for (size_t i = 0; i < components.size(); ++i) {
    const ComponentInstance& instance = graph.component(components[i].index);
    for (OutputPort* output : components[i].wiring.outputs()) {
      const int channel = ChannelOf(graph, instance.name(), instance.output(), output->name());
      const std::string& name = graph.channel(channel).name();
      outboxes_.push_back(std::make_unique<Outbox>(output, i, channel, name,
                                                   RunSender(socket, ChannelUrl(spec, channel)),
                                                   Awaited(graph, ProcessOf(instance), name)));
    }
  }
  unsent_.reserve(outboxes_.size());
}

void ProcessBus::BindStages(const RunSpec& spec, size_t component,
                            const ConfiguredComponent& configured) {
  const ComponentInstance& instance = spec.graph().component(configured.index);
  for (const Stage& stage : configured.wiring.stages()) {
    BoundStage bound{component, &stage, {}, {}, {}};
    for (InputPort* input : stage.inputs) {
      BindInput(spec, instance, input, &bound);
    }
    for (const OutputPort* output : stage.outputs) {
      const auto outbox =
          std::ranges::find_if(outboxes_, [&](const auto& o) { return &o->port() == output; });
      bound.outputs.push_back(outbox->get());
    }
    stages_.push_back(std::move(bound));
  }
}

void ProcessBus::BindInput(const RunSpec& spec, const ComponentInstance& instance, InputPort* input,
                           BoundStage* stage) {
  if (auto* const acts = dynamic_cast<ActInput*>(input); acts != nullptr) {
    const auto connected = [&](const Connection& c) { return c.port() == input->name(); };
    if (std::ranges::none_of(instance.input(), connected)) return;
    const auto is_this = [&](const ComponentInstance& c) { return &c == &instance; };
    const auto& all = spec.graph().component();
    acts->SetAddress(static_cast<int>(std::ranges::find_if(all, is_this) - all.begin()));
    acts_.push_back(acts);
  }
  const int channel = ChannelOf(spec.graph(), instance.name(), instance.input(), input->name());
  const auto writer =
      std::ranges::find_if(outboxes_, [&](const auto& o) { return o->channel() == channel; });
  // What a component says to itself goes over the bus when it is alone, as ever.
  if (writer == outboxes_.end() || counters_.size() == 1) {
    stage->inputs.push_back({InboxOf(spec, stage->component, channel, input), channel});
    return;
  }
  const OutputPort& output = (*writer)->port();
  if (input->counts() != output.counts()) {
    throw ConfigError(
        fmt::format("component {}: input {} and the writer of channel {} differ in "
                    "their counts",
                    instance.name(), input->name(), spec.graph().channel(channel).name()));
  }
  if (input->kind() == InputKind::kSameTick) {
    stage->locals.push_back({input, output.message()});
    return;
  }
  auto delayed =
      std::ranges::find_if(delayed_, [&](const Delayed& d) { return d.output == &output; });
  if (delayed == delayed_.end()) {
    delayed_.push_back({input, &output, OwnedMessage(input)});
    delayed = delayed_.end() - 1;
  }
  stage->locals.push_back({input, delayed->message.get()});
}

Inbox* ProcessBus::InboxOf(const RunSpec& spec, size_t component, int channel, InputPort* input) {
  for (const auto& inbox : inboxes_) {
    if (&inbox->port() == input) return inbox.get();  // of a stage before
  }
  inboxes_.push_back(std::make_unique<Inbox>(input, spec.run_id(), join_, component));
  const Channel& of = spec.graph().channel(channel);
  std::vector<Origin> origins = {OfRun(spec)};
  if (TakesStopsOfAll(of)) origins.push_back(OfOthers(spec));
  for (const Origin& origin : origins) {
    auto link = std::ranges::find_if(links_, [&](const auto& l) {
      return l->channel == channel && l->origin.who == origin.who;
    });
    if (link == links_.end()) {
      links_.push_back(std::make_unique<DataLink>());
      link = links_.end() - 1;
      (*link)->url = ChannelUrl(spec, channel);
      (*link)->channel = channel;
      (*link)->channel_name = of.name();
      (*link)->origin = origin;
    }
    (*link)->inboxes.push_back(inboxes_.back().get());
  }
  return inboxes_.back().get();
}

void ProcessBus::OpenInputs() {
  for (size_t i = 0; i < links_.size(); ++i) {
    links_[i]->receiver.emplace(links_[i]->url, links_[i]->origin);
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
    } else if (link.origin.who == Origin::kOthers && !OnlyStops(packet)) {
      ++link.foreign;
    } else if (faults_.Drop()) {
      ++counters_[link.inboxes.front()->component()].dropped;
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
        if (outbox->channel() == control.channel && outbox->Resend(control.tick)) {
          ++counters_[outbox->component()].resends;
        }
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

void ProcessBus::Send(Outbox* outbox, int64_t tick) {
  if (outbox->awaited()) {
    CountSend(outbox->Send(tick), outbox->component());
  } else {
    unsent_.push_back({outbox, tick});
  }
}

void ProcessBus::SendRest() {
  for (const Unsent& unsent : unsent_) {
    CountSend(unsent.outbox->Send(unsent.tick), unsent.outbox->component());
  }
  unsent_.clear();
}

void ProcessBus::SendAnswers() {
  operate::answer_t answer;
  for (ActInput* const acts : acts_) {
    while (acts->TakeAnswer(&answer)) {
      if (!answer_sender_) continue;
      answer.encode(answer_bytes_.data(), 0, static_cast<int>(answer_bytes_.size()));
      CountSend(answer_sender_->Send(answer_channel_, answer_bytes_.data(), answer_bytes_.size()),
                0);
    }
  }
}

void ProcessBus::KeepDelayed() {
  for (Delayed& delayed : delayed_) {
    delayed.port->CopyMessage(delayed.output->message(), delayed.message.get());
  }
}

void ProcessBus::Ask(const BoundStage& stage, int64_t tick) {
  for (const BoundStage::BoundInput& input : stage.inputs) {
    const InputKind kind = input.inbox->port().kind();
    if (input.inbox->ready() || (tick == 0 && kind == InputKind::kPreviousTick)) continue;
    input.inbox->CountGap();
    SendControl(run_control_t::COMMAND_RESEND, input.inbox->wanted(), input.channel);
  }
}

bool ProcessBus::SendControl(int8_t command, int64_t tick, int32_t channel) {
  const bool sent = service_.SendControl(command, tick, channel);
  CountSend(sent, 0);
  return sent;
}

void ProcessBus::CountSend(bool sent, size_t component) {
  if (!broken()) send_failures_ = sent ? 0 : send_failures_ + 1;
  counters_[component].publish_errors += sent ? 0 : 1;
}

void ProcessBus::SendHealth() {
  for (size_t i = 0; i < counters_.size(); ++i) {
    health_t& health = service_.health(i);
    health.messages_received = health.messages_duplicate = health.gaps = 0;
    health.messages_refused = i == 0 ? service_.refused() : 0;
    health.messages_dropped = counters_[i].dropped;
    health.resends = counters_[i].resends;
    health.publish_errors = counters_[i].publish_errors;
  }
  for (const auto& inbox : inboxes_) {
    health_t& health = service_.health(inbox->component());
    health.messages_received += inbox->counters().accepted();
    health.messages_refused += inbox->counters().refused();
    health.messages_duplicate += inbox->duplicates();
    health.gaps += inbox->gaps();
  }
  for (const auto& link : links_) {
    service_.health(link->inboxes.front()->component()).messages_refused +=
        link->foreign + (link->receiver ? link->receiver->malformed() : 0);
  }
  for (size_t i = 0; i < counters_.size(); ++i) CountSend(service_.SendHealth(i), i);
}

}  // namespace poise
