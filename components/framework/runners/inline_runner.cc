#include "components/framework/runners/inline_runner.h"

#include <algorithm>
#include <utility>

#include "components/framework/bus/owned_message.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {

struct InlineRunner::Delayed {
  int channel;
  const InputPort* port;  // any reader: knows how to copy
  const void* output;
  OwnedMessage message;
};

struct InlineRunner::External {
  int channel;
  const InputPort* port;
  PacketFilter filter;
  OwnedMessage shown;
  OwnedMessage spare;
  bool present = false;
};

struct InlineRunner::BoundStage {
  struct BoundInput {
    InputPort* port;
    const void* message;  // of the writer, or of a Delayed; nullptr: external
    size_t external;
  };
  int component;
  const Stage* stage;
  std::vector<BoundInput> inputs;
  std::vector<int> output_channels;
  StageAllocations allocations = {};
};

InlineRunner::InlineRunner(const RunSpec& spec, const ComponentRegistry& registry)
    : InlineRunner(spec, BoundGraph(spec, registry)) {}

InlineRunner::InlineRunner(const RunSpec& spec, BoundGraph graph)
    : run_id_(spec.run_id()),
      period_(spec.tick_period()),
      lead_(spec.lead_ticks()),
      num_ticks_(spec.num_ticks()),
      graph_(std::move(graph)),
      latency_(static_cast<size_t>(graph_.num_components())) {
  const GraphPlan& plan = graph_.plan();
  const auto output_of = [&](int channel) {
    const GraphPlan::Endpoint& writer = plan.channels[static_cast<size_t>(channel)].writer;
    return graph_.component(writer.component).wiring.outputs()[static_cast<size_t>(writer.port)];
  };
  // Messages of the tick before and of external channels, one a channel.
  for (int i = 0; i < graph_.num_components(); ++i) {
    const std::vector<InputPort*>& inputs = graph_.component(i).wiring.inputs();
    for (size_t k = 0; k < inputs.size(); ++k) {
      const int channel = plan.input_channel[static_cast<size_t>(i)][k];
      if (channel < 0) continue;
      if (auto* const acts = dynamic_cast<ActInput*>(inputs[k]); acts != nullptr) {
        acts->SetAddress(i);
        acts_.push_back(acts);
      }
      const auto same = [&](const auto& entry) { return entry.channel == channel; };
      if (inputs[k]->kind() == InputKind::kPreviousTick &&
          std::none_of(delayed_.begin(), delayed_.end(), same)) {
        delayed_.push_back(
            {channel, inputs[k], output_of(channel)->message(), OwnedMessage(inputs[k])});
      }
      if (inputs[k]->kind() == InputKind::kLatest &&
          std::none_of(external_.begin(), external_.end(), same)) {
        external_.push_back({channel, inputs[k],
                             PacketFilter(inputs[k]->fingerprint(), inputs[k]->encoded_size(),
                                          inputs[k]->counts(), run_id_),
                             OwnedMessage(inputs[k]), OwnedMessage(inputs[k])});
      }
    }
  }
  for (size_t c = 0; c < plan.channels.size(); ++c) {
    if (plan.channels[c].type != kAnswerType || !plan.channels[c].external) continue;
    answer_channel_ = static_cast<int>(c);
    answer_bytes_.resize(static_cast<size_t>(operate::answer_t{}.getEncodedSize()));
  }
  for (const GraphPlan::StageRef& ref : plan.order) {
    const auto c = static_cast<size_t>(ref.component);
    const Wiring& wiring = graph_.component(ref.component).wiring;
    BoundStage bound{ref.component, &wiring.stages()[static_cast<size_t>(ref.stage)], {}, {}, {}};
    bound.allocations.component = graph_.component(ref.component).name;
    bound.allocations.stage = bound.stage->name;
    for (InputPort* input : bound.stage->inputs) {
      const auto k = std::find(wiring.inputs().begin(), wiring.inputs().end(), input) -
                     wiring.inputs().begin();
      const int channel = plan.input_channel[c][static_cast<size_t>(k)];
      if (channel < 0) continue;
      const auto same = [&](const auto& entry) { return entry.channel == channel; };
      BoundStage::BoundInput bound_input{input, nullptr, 0};
      if (input->kind() == InputKind::kSameTick) {
        bound_input.message = output_of(channel)->message();
      } else if (input->kind() == InputKind::kPreviousTick) {
        bound_input.message = std::find_if(delayed_.begin(), delayed_.end(), same)->message.get();
      } else {
        bound_input.external = static_cast<size_t>(
            std::find_if(external_.begin(), external_.end(), same) - external_.begin());
      }
      bound.inputs.push_back(bound_input);
    }
    for (const OutputPort* output : bound.stage->outputs) {
      const auto o = std::find(wiring.outputs().begin(), wiring.outputs().end(), output) -
                     wiring.outputs().begin();
      bound.output_channels.push_back(plan.output_channel[c][static_cast<size_t>(o)]);
    }
    stages_.push_back(std::move(bound));
  }
}

InlineRunner::~InlineRunner() = default;

bool InlineRunner::RunStage(BoundStage& bound, const Tick& tick) {
  const int64_t start = NowNanoseconds();
  for (const BoundStage::BoundInput& input : bound.inputs) {
    const void* message = input.message;
    if (input.port->kind() == InputKind::kPreviousTick && tick.index == 0) message = nullptr;
    if (input.port->kind() == InputKind::kLatest) {
      const External& external = external_[input.external];
      message = external.present ? external.shown.get() : nullptr;
    }
    input.port->Bind(message);
  }
  for (OutputPort* output : bound.stage->outputs) output->Stamp(run_id_, tick.index, tick.utime);
  position_->stage.store(static_cast<int32_t>(&bound - stages_.data()), std::memory_order_relaxed);
  const int64_t before = count_allocations_ != nullptr ? count_allocations_() : 0;
  bound.stage->run(tick);
  position_->stage.store(RunPosition::kNoStage, std::memory_order_relaxed);
  if (count_allocations_ != nullptr) {
    const int64_t made = count_allocations_() - before;
    bound.allocations.ticks += made > 0 ? 1 : 0;
    bound.allocations.total += made;
    bound.allocations.most = std::max(bound.allocations.most, made);
  }
  // Outside its stage an input shows nothing, as in a graph of processes.
  for (const BoundStage::BoundInput& input : bound.inputs) input.port->Bind(nullptr);
  latency_[static_cast<size_t>(bound.component)].Add(NowNanoseconds() - start);

  ConfiguredComponent& configured = graph_.component(bound.component);
  for (size_t o = 0; o < bound.stage->outputs.size(); ++o) {
    const OutputPort& output = *bound.stage->outputs[o];
    if (!output.Finite()) {
      Stop(configured, true,
           fmt::format("output {} is not finite at tick {}", output.name(), tick.index));
      return false;
    }
    if (tap_) tap_(bound.output_channels[o], output, tick);
  }
  const std::string_view finished = configured.component->finished();
  if (!finished.empty() && !ended_) {
    Stop(configured, configured.component->failed(), std::string(finished));
  }
  return true;
}

void InlineRunner::Stop(const ConfiguredComponent& component, bool failed, const std::string& why) {
  ended_ = true;
  failed_ = failed;
  end_component_ = component.name;
  end_detail_ = fmt::format("{}: {}", component.name, why);
}

std::vector<InlineRunner::StageName> InlineRunner::StageNames() {
  std::vector<StageName> names;
  for (const BoundStage& stage : stages_) {
    names.push_back({graph_.component(stage.component).name, stage.stage->name});
  }
  return names;
}

bool InlineRunner::Step() {
  if (ended_) return false;
  const int64_t start = NowNanoseconds();
  const Tick tick = MakeTick(next_tick_, period_, lead_);
  position_->tick.store(tick.index, std::memory_order_relaxed);
  for (; next_stage_ < stages_.size(); ++next_stage_) {
    if (!RunStage(stages_[next_stage_], tick)) return false;
  }
  next_stage_ = 0;
  for (Delayed& delayed : delayed_)
    delayed.port->CopyMessage(delayed.output, delayed.message.get());
  TakeAnswers();
  ++next_tick_;
  if (num_ticks_ > 0 && next_tick_ >= num_ticks_) ended_ = true;
  tick_latency_.Add(NowNanoseconds() - start);
  return !ended_;
}

void InlineRunner::BeginTick(const std::function<bool(int component)>& until) {
  const Tick tick = MakeTick(next_tick_, period_, lead_);
  while (!ended_ && next_stage_ < stages_.size() && !until(stages_[next_stage_].component) &&
         RunStage(stages_[next_stage_], tick)) {
    ++next_stage_;
  }
}

int64_t InlineRunner::Run(int64_t ticks, const std::atomic<bool>* stop) {
  const int64_t first = next_tick_;
  while (next_tick_ - first < ticks && !ended_ &&
         (stop == nullptr || !stop->load(std::memory_order_relaxed)))
    Step();
  return next_tick_ - first;
}

bool InlineRunner::Inject(const std::string& channel, std::span<const uint8_t> data) {
  for (External& external : external_) {
    if (graph_.plan().channels[static_cast<size_t>(external.channel)].name != channel) continue;
    if (external.filter.Check(data.data(), data.size(), INT64_MIN, INT64_MAX) !=
            PacketVerdict::kAccepted ||
        !external.port->Decode(data.data(), static_cast<int>(data.size()), external.spare.get())) {
      return false;
    }
    if (external_tap_) external_tap_(external.channel, data);
    if (external.port->type_name() == kActType) {
      for (ActInput* const acts : acts_) {
        acts->Offer(*static_cast<const operate::act_t*>(external.spare.get()));
      }
      TakeAnswers();
      return true;
    }
    external.port->CopyMessage(external.spare.get(), external.shown.get());
    external.present = true;
    return true;
  }
  return false;
}

void InlineRunner::TakeAnswers() {
  operate::answer_t answer;
  for (ActInput* const acts : acts_) {
    while (acts->TakeAnswer(&answer)) {
      if (answer_channel_ < 0 || !external_tap_) continue;
      answer.encode(answer_bytes_.data(), 0, static_cast<int>(answer_bytes_.size()));
      external_tap_(answer_channel_, answer_bytes_);
    }
  }
}

std::vector<InlineRunner::StageAllocations> InlineRunner::allocations() const {
  std::vector<StageAllocations> result;
  for (const BoundStage& stage : stages_) result.push_back(stage.allocations);
  return result;
}

const LatencyHistogram& InlineRunner::latency(int component) const {
  return latency_[static_cast<size_t>(component)];
}

}  // namespace poise
