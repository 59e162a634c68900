#include "logging/replay/component_replay.h"

#include <algorithm>
#include <limits>
#include <set>
#include <span>

#include "components/framework/bus/owned_message.h"
#include "components/framework/clock.h"
#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "components/framework/runners/timing.h"
#include "fmt/format.h"
#include "logging/element_names.h"
#include "logging/replay/message_difference.h"
#include "logging/run_log_writer.h"
#include "logging/run_record.h"

namespace poise::logging {
namespace {

void AddDifferences(const MessageType& type, std::span<const uint8_t> logged,
                    std::span<const uint8_t> replayed, int64_t tick, ReplayedChannel* channel) {
  const auto scalars = DifferingScalars(type, logged, replayed);
  if (!scalars) throw LogError(fmt::format("{}: tick {}: not decodable", channel->channel, tick));
  if (channel->differing++ == 0) {
    channel->first_differing_tick = tick;
    channel->first_field = scalars->front().path;
  }
  for (const ScalarDifference& scalar : *scalars) {
    const std::string name = WithoutIndexes(scalar.path);
    auto field = std::ranges::find(channel->fields, name, &FieldDifference::field);
    if (field == channel->fields.end()) {
      channel->fields.push_back({name, tick, -1, 0, {}, 0, -1, {}, {}});
      field = channel->fields.end() - 1;
    }
    field->ticks += field->last_tick != tick ? 1 : 0;
    field->last_tick = tick;
    if (scalar.size > field->largest) {
      field->largest = scalar.size;
      field->largest_path = scalar.path;
      field->largest_tick = tick;
      field->logged = scalar.first;
      field->replayed = scalar.second;
    }
  }
}

}  // namespace

bool ReplayedComponent::equal() const {
  return std::ranges::all_of(outputs,
                             [](const ReplayedChannel& output) { return output.differing == 0; });
}

LogReplay::LogReplay(const std::string& path) : path_(path), messages_(path) {
  std::map<std::string, size_t, std::less<>> index;
  for (const Channel& channel : spec().graph().channel()) {
    index[channel.name()] = lanes_.size();
    lanes_.push_back({ChannelTicks(spec(), channel, messages_.reader().file_size()),
                      &ChannelType(channel),
                      {},
                      {}});
  }
  external_.resize(lanes_.size());
  LogEvent event;
  int64_t newest = -1;
  for (int64_t place = 0; messages_.reader().Next(&event); ++place) {
    const auto found = index.find(event.channel);
    if (found == index.end()) continue;
    const auto i = static_cast<int>(found->second);
    Lane& lane = lanes_[found->second];
    if (spec().graph().channel(i).external()) {
      if (messages_.TypeOf(event) == lane.type) {
        external_[found->second].push_back({newest + 1, false, event.data});
      }
      continue;
    }
    const std::optional<int64_t> tick = lane.ticks.Check(event.data);
    if (!tick) continue;
    lane.ticks.Take(*tick);
    newest = std::max(newest, *tick);
    lane.by_tick.Set(*tick, event.data);
    lane.place.Set(*tick, place);
  }
}

/// A component with its ports' places in the log.
class ReplayedStages {
 public:
  ReplayedStages(const LogReplay& log, const RunSpec& spec, int index,
                 const ComponentRegistry& registry, ChangedMessages* changed,
                 const OnStages& on_stages)
      : log_(log),
        spec_(spec),
        instance_(spec.graph().component(index)),
        changed_(changed),
        timing_(poise::TimingOf(spec, index)) {
    const ComponentFactory* const factory = registry.Find(poise::TypeOf(instance_));
    if (factory == nullptr) {
      Fail(fmt::format("this program has no component type '{}'", poise::TypeOf(instance_)));
    }
    component_ = ConfigureComponent(spec, index, *factory, &shared_);
    CheckWiring(spec.graph(), index, component_.wiring);
    for (const OutputPort* output : component_.wiring.outputs()) {
      const int channel = ChannelOf(instance_.output(), output->name());
      if (channel >= 0 && lane(channel).type == FindMessageType("bridge_status_t")) {
        status_ = channel;
      }
    }
    for (const Stage& stage : component_.wiring.stages()) Bind(stage);
    CheckLog();
    if (!on_stages) return;
    std::vector<std::string> names;
    for (const Stage& stage : component_.wiring.stages()) names.push_back(stage.name);
    position_ = on_stages(names);
  }

  ReplayedComponent Run() {
    result_.name = component_.name;
    result_.ticks = end_;
    const int64_t start = NowNanoseconds();
    size_t next_act = 0;
    for (int64_t t = 0; t < end_; ++t) {
      if (timing_ == poise::Timing::kFollower && !Ran(t)) {
        ++result_.skipped_ticks;
        continue;
      }
      for (; next_act < placed_acts_.size() && placed_acts_[next_act].tick <= t; ++next_act) {
        act_input_->Place(placed_acts_[next_act].act, t);
      }
      Tick tick = MakeTick(t, spec_.tick_period(), spec_.lead_ticks());
      if (timing_ == poise::Timing::kOwner) {
        if (const auto status = BridgeStatus(t)) tick.lateness = status->lateness;
      }
      position_->tick.store(t, std::memory_order_relaxed);
      for (BoundStage& stage : stages_) {
        if (t < stage.end) RunStage(&stage, tick);
      }
    }
    result_.wall_time = static_cast<double>(NowNanoseconds() - start) * 1e-9;
    return std::move(result_);
  }

 private:
  struct Input {
    InputPort* port;
    int channel;
    OwnedMessage message;
    std::vector<ExternalMessage> external;  // of kLatest
    size_t next_external = 0;
    bool present = false;
    int64_t shown = -1;  // tick of the newest that was shown
  };
  struct Output {
    OutputPort* port;
    int channel;    // of the log's graph; -1: it has none of that name
    size_t result;  // in result_.outputs
  };
  struct BoundStage {
    const Stage* stage;
    std::vector<Input> inputs;
    std::vector<Output> outputs;
    int64_t end = 0;  // first tick that is not replayed
  };

  [[noreturn]] void Fail(const std::string& problem) const {
    throw LogError(
        fmt::format("{}: {} cannot be replayed: {}", log_.path_, instance_.name(), problem));
  }

  using Connections = google::protobuf::RepeatedPtrField<Connection>;

  /// Returns the name of the channel at the component's port; CheckWiring has found it.
  static std::string ChannelName(const Connections& connections, const std::string& port) {
    const auto found = std::ranges::find_if(
        connections, [&](const Connection& connection) { return connection.port() == port; });
    return found == connections.end() ? "" : found->channel();
  }

  /// The index of the port's channel in the log's graph, which another configuration may have more
  /// or fewer channels than; -1: it is not there.
  int ChannelOf(const Connections& connections, const std::string& port) const {
    const std::string name = ChannelName(connections, port);
    const auto& channels = log_.spec().graph().channel();
    for (int i = 0; i < channels.size(); ++i) {
      if (channels[i].name() == name) return i;
    }
    return -1;
  }

  int InputChannel(const std::string& port) const {
    const int channel = ChannelOf(instance_.input(), port);
    if (channel < 0) {
      Fail(fmt::format("the log's graph has no channel {}, which it reads",
                       ChannelName(instance_.input(), port)));
    }
    return channel;
  }

  void Bind(const Stage& stage) {
    BoundStage bound{&stage, {}, {}, 0};
    for (InputPort* port : stage.inputs) {
      if (auto* const acts = dynamic_cast<ActInput*>(port); acts != nullptr) {
        PlaceActs(acts);
        continue;
      }
      const int channel = InputChannel(port->name());
      CheckSize(channel, port->encoded_size());
      bound.inputs.push_back({port, channel, OwnedMessage(port), External(port, channel)});
    }
    for (OutputPort* port : stage.outputs) {
      const int channel = ChannelOf(instance_.output(), port->name());
      bound.outputs.push_back({port, channel, result_.outputs.size()});
      result_.outputs.emplace_back().channel = ChannelName(instance_.output(), port->name());
      if (channel < 0) continue;
      CheckSize(channel, port->encoded_size());
      end_ = std::max(end_, lane(channel).ticks.newest() + 1);
    }
    stages_.push_back(std::move(bound));
  }

  /// An operator's acts on this component, each in the tick that its answer tells: what was refused
  /// has had no effect, and of what the log holds no answer it does not say.
  void PlaceActs(ActInput* acts) {
    int component = 0;
    while (&spec_.graph().component(component) != &instance_) ++component;
    std::map<int64_t, operate::answer_t> answers;
    for (size_t c = 0; c < log_.lanes_.size(); ++c) {
      if (log_.lanes_[c].type->name != kAnswerType) continue;
      for (const ExternalMessage& message : log_.external_[c]) {
        operate::answer_t answer;
        if (!DecodeChecked(message.data, &answer) || answer.component != component) {
          continue;
        }
        answers.emplace(answer.id, answer);
      }
    }
    std::set<int64_t> placed;
    for (const Connection& connection : instance_.input()) {
      if (connection.port() != acts->name()) continue;
      const int channel = InputChannel(acts->name());
      for (const ExternalMessage& message : log_.external_[static_cast<size_t>(channel)]) {
        operate::act_t act;
        if (static_cast<int>(message.data.size()) != acts->encoded_size() ||
            !acts->Decode(message.data.data(), acts->encoded_size(), &act) ||
            act.component != component || act.kind == operate::act_t::KIND_ASK ||
            !placed.insert(act.id).second) {
          continue;
        }
        ++result_.external_messages;
        const auto answer = answers.find(act.id);
        if (answer == answers.end()) {
          // An act without an answer may have died with its process; the tick that it names is the
          // best guess.
          ++result_.unplaced_messages;
          placed_acts_.push_back({act, act.tick});
        } else if (answer->second.verdict == operate::answer_t::VERDICT_DONE) {
          placed_acts_.push_back({act, answer->second.tick});
        }
      }
    }
    std::ranges::stable_sort(placed_acts_, {}, &PlacedAct::tick);
    act_input_ = acts;
  }

  /// The messages of an external channel, placed in the ticks that the component itself tells.
  std::vector<ExternalMessage> External(const InputPort* port, int channel) const {
    if (port->kind() != InputKind::kLatest) return {};
    std::vector<ExternalMessage> messages = log_.external_[static_cast<size_t>(channel)];
    if (lane(channel).type != FindMessageType("emergency_stop_t")) return messages;
    if (status_ >= 0) PlaceEmergencyStops(lane(status_).by_tick, &messages);
    return messages;
  }

  void CheckSize(int channel, int size) const {
    const Channel& c = log_.spec().graph().channel(channel);
    if (MessageSize(c) != size) {
      Fail(fmt::format("{}: its messages do not have the counts of the log's robot", c.name()));
    }
  }

  /// What the log lacks, all of it in one error.
  void CheckLog() {
    std::vector<std::string> lacking;
    if (end_ == 0) lacking.push_back("the log holds no message of its outputs");
    // What was late is part of the run.
    if (end_ > 0 && (timing_ == poise::Timing::kOwner || timing_ == poise::Timing::kFollower)) {
      for (BoundStage& stage : stages_) stage.end = end_;
      return;
    }
    std::set<int> named;
    for (BoundStage& stage : stages_) {
      // The recording may have ended inside the last tick.
      const auto has_last = [&](int channel) { return lane(channel).ticks.newest() >= end_ - 1; };
      bool last = true;
      for (const Output& output : stage.outputs) {
        last = last && (output.channel < 0 || has_last(output.channel));
      }
      for (const Input& input : stage.inputs) {
        const bool same_tick = input.port->kind() == InputKind::kSameTick;
        if (stage.outputs.empty() && same_tick) last = last && has_last(input.channel);
      }
      stage.end = last ? end_ : end_ - 1;
      for (const Output& output : stage.outputs) {
        if (output.channel >= 0 && named.insert(output.channel).second) {
          AddMissing(output.channel, stage.end, "to compare with", &lacking);
        }
      }
      for (const Input& input : stage.inputs) {
        if (input.port->kind() == InputKind::kLatest) continue;
        const bool previous = input.port->kind() == InputKind::kPreviousTick;
        if (named.insert(input.channel).second) {
          AddMissing(input.channel, previous ? stage.end - 1 : stage.end, "to feed it", &lacking);
        }
      }
    }
    if (lacking.empty()) return;
    const bool cut = spec_.cut().first_tick() > 0 || !spec_.cut().channel().empty();
    Fail(fmt::format("{}{}", fmt::join(lacking, "; "),
                     cut ? "; it is cut from a longer log, which may have it" : ""));
  }

  void AddMissing(int channel, int64_t end, const char* purpose,
                  std::vector<std::string>* lacking) const {
    const std::vector<TickRange> missing = lane(channel).ticks.Missing(0, end);
    if (missing.empty()) return;
    const int64_t refused = lane(channel).ticks.refused();
    lacking->push_back(fmt::format(
        "the log lacks {} of tick {} to {}{}, {}{}", log_.spec().graph().channel(channel).name(),
        missing.front().first, missing.front().last,
        missing.size() > 1 ? fmt::format(" and {} more ranges", missing.size() - 1) : "", purpose,
        refused > 0 ? fmt::format(" ({} messages of it are refused: poise log check)", refused)
                    : ""));
  }

  /// The tick whose message an input has in lockstep.
  static int64_t TickOf(const Input& input, int64_t tick) {
    return input.port->kind() == InputKind::kPreviousTick ? tick - 1 : tick;
  }

  /// Whether a follower ran in a tick: the log has something it sent then, and all that it read.
  bool Ran(int64_t tick) const {
    const auto has = [&](int channel, int64_t of) {
      return channel >= 0 && lane(channel).by_tick.at(of) != nullptr;
    };
    bool sent = false;
    for (const BoundStage& stage : stages_) {
      for (const Output& output : stage.outputs) sent = sent || has(output.channel, tick);
      for (const Input& input : stage.inputs) {
        if (input.port->kind() == InputKind::kLatest) continue;
        const int64_t of = TickOf(input, tick);
        if (of >= 0 && !has(input.channel, of)) return false;
      }
    }
    return sent;
  }

  /// What the component says of the tick, if it is a bridge.
  std::optional<bridge_status_t> BridgeStatus(int64_t tick) const {
    return status_ < 0 ? std::nullopt : StatusAt(lane(status_).by_tick, tick);
  }

  /// Whether a bridge's cycle had no command that it took or refused.
  bool WithoutCommand(const Input& input, int64_t tick) const {
    if (lane(input.channel).type != FindMessageType("joint_command_t")) return false;
    const auto now = BridgeStatus(tick);
    const auto refused = [](const bridge_status_t& status) {
      return status.refused_not_finite + status.refused_stale + status.refused_sequence +
             status.refused_size + status.refused_run;
    };
    const auto before = BridgeStatus(tick - 1);
    return now && now->command_age > 0 && refused(*now) == (before ? refused(*before) : 0);
  }

  /// The place in the log of the first message that the stage, or one after it, sent in a tick.
  int64_t PlaceOf(const BoundStage& stage, int64_t tick) const {
    for (const BoundStage& of : std::span(&stage, stages_.data() + stages_.size())) {
      for (const Output& output : of.outputs) {
        if (output.channel < 0) continue;
        if (const int64_t* const at = lane(output.channel).place.at(tick)) return *at;
      }
    }
    return std::numeric_limits<int64_t>::max();
  }

  /// The newest tick up to `wanted`, of those an inbox holds, whose message had come and was not
  /// shown yet; -1: none had.
  int64_t NewestBefore(const Input& input, int64_t wanted, int64_t place) const {
    for (int64_t t = wanted; t > std::max(input.shown, wanted - kReceiveWindow); --t) {
      const int64_t* const at = lane(input.channel).place.at(t);
      if (at != nullptr && *at < place) return t;
    }
    return -1;
  }

  /// Shows an input the message it had in the run.
  void Show(const BoundStage& stage, Input* input, int64_t tick) {
    const InputKind kind = input->port->kind();
    if (kind == InputKind::kLatest) {
      while (input->next_external < input->external.size() &&
             input->external[input->next_external].tick <= tick) {
        const ExternalMessage& message = input->external[input->next_external++];
        ++result_.external_messages;
        result_.unplaced_messages += message.certain ? 0 : 1;
        input->present = Decode(input, message.data) || input->present;
      }
    } else {
      int64_t wanted = TickOf(*input, tick);
      if (timing_ == poise::Timing::kOwner && wanted >= 0) {
        const int64_t newest =
            WithoutCommand(*input, tick) ? -1 : NewestBefore(*input, wanted, PlaceOf(stage, tick));
        result_.late_inputs += newest != wanted ? 1 : 0;
        wanted = newest;
        input->shown = std::max(input->shown, newest);
      }
      input->present = wanted >= 0;
      if (input->present && !Decode(input, Logged(input->channel, wanted))) {
        Fail(fmt::format("{} of tick {} is not finite",
                         log_.spec().graph().channel(input->channel).name(), wanted));
      }
    }
    input->port->Bind(input->present ? input->message.get() : nullptr);
  }

  static bool Decode(Input* input, std::span<const uint8_t> data) {
    return static_cast<int>(data.size()) == input->port->encoded_size() &&
           input->port->Decode(data.data(), static_cast<int>(data.size()), input->message.get());
  }

  void RunStage(BoundStage* stage, const Tick& tick) {
    for (Input& input : stage->inputs) Show(*stage, &input, tick.index);
    for (const Output& output : stage->outputs) {
      output.port->Stamp(spec_.run_id(), tick.index, tick.utime);
    }
    position_->stage.store(static_cast<int32_t>(stage - stages_.data()), std::memory_order_relaxed);
    stage->stage->run(tick);
    position_->stage.store(RunPosition::kNoStage, std::memory_order_relaxed);
    for (const Input& input : stage->inputs) input.port->Bind(nullptr);
    for (const Output& output : stage->outputs) {
      if (output.channel < 0) continue;
      const auto size = static_cast<size_t>(output.port->encoded_size());
      buffer_.resize(size);
      output.port->Encode(buffer_.data(), static_cast<int>(size));
      ReplayedChannel& channel = result_.outputs[output.result];
      const std::span<const uint8_t> logged = Logged(output.channel, tick.index);
      if (logged.empty()) continue;  // in real time what a stage was too late for
      ++channel.ticks;
      if (!SameBits(*lane(output.channel).type, logged, buffer_)) {
        AddDifferences(*lane(output.channel).type, logged, buffer_, tick.index, &channel);
        if (changed_ != nullptr) (*changed_)[{channel.channel, tick.index}] = buffer_;
      }
    }
  }

  const LogReplay::Lane& lane(int channel) const {
    return log_.lanes_[static_cast<size_t>(channel)];
  }
  std::span<const uint8_t> Logged(int channel, int64_t tick) const {
    const std::span<const uint8_t>* const data = lane(channel).by_tick.at(tick);
    return data == nullptr ? std::span<const uint8_t>() : *data;
  }

  struct PlacedAct {
    operate::act_t act;
    int64_t tick;
  };

  const LogReplay& log_;
  const RunSpec& spec_;
  const ComponentInstance& instance_;
  ChangedMessages* changed_;
  ActInput* act_input_ = nullptr;
  std::vector<PlacedAct> placed_acts_;  // by tick
  SharedObjects shared_;                // of its own, as in a process
  ConfiguredComponent component_;
  std::vector<BoundStage> stages_;
  RunPosition own_position_;
  RunPosition* position_ = &own_position_;
  poise::Timing timing_;
  int status_ = -1;  // channel of what a bridge says of itself; -1: the component is none
  int64_t end_ = 0;
  std::vector<uint8_t> buffer_;
  ReplayedComponent result_;
};

ReplayedComponent LogReplay::Replay(const RunSpec& spec, int index,
                                    const ComponentRegistry& registry, ChangedMessages* changed,
                                    const OnStages& on_stages) const {
  return ReplayedStages(*this, spec, index, registry, changed, on_stages).Run();
}

void LogReplay::Write(const std::string& to, const run_info_t& info,
                      const ChangedMessages& changed) const {
  EventLogWriter writer(to);
  writer.Write(kRunInfoChannel, 0, MessageBytes(info));
  LogReader reader(path_);
  LogEvent event;
  while (reader.Next(&event)) {
    if (event.channel == kRunInfoChannel) continue;
    const MessageType* const type = messages_.TypeOf(event);
    const auto found =
        type == nullptr || !type->has_header
            ? changed.end()
            : changed.find({std::string(event.channel), LogMessages::Tick(*type, event)});
    writer.Write(event.channel, event.utime,
                 found == changed.end() ? event.data : std::span(found->second));
  }
  writer.Close(/*sums=*/true);
}

}  // namespace poise::logging
