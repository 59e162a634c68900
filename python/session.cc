#include "python/session.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "components/framework/modules.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "logging/events/bridge_words.h"
#include "poise/bridge_status_t.hpp"
#include "tools/cli/lists.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"

namespace poise::python {

using logging::LogError;

namespace {

/// The simulated robot's messages of a recorded run, tick by tick.
class RecordedPlant : public ForeignFunctions {
 public:
  /// `channels`: by port, of the outputs.
  RecordedPlant(std::shared_ptr<const RunStore> run, std::map<std::string, std::string> channels)
      : run_(std::move(run)), channels_(std::move(channels)) {}

  void Configure(const ComponentContext&, std::span<const ForeignPort> ports) override {
    of_port_.clear();
    for (const ForeignPort& port : ports) {
      of_port_.push_back(nullptr);
      if (port.port.input) continue;
      const StoredChannel* const channel = run_->Find(channels_.at(port.port.name));
      if (channel == nullptr) {
        throw ConfigError(
            fmt::format("the recorded run has no messages on {}", channels_.at(port.port.name)));
      }
      if (channel->type->name != port.port.type || channel->counts != port.counts) {
        throw ConfigError(
            fmt::format("{} of the recorded run is of another type or robot", channel->name));
      }
      of_port_.back() = channel;
    }
    run_->CheckUnchanged();
  }
  void Step(const Tick& tick, std::span<ForeignPort> ports) override {
    run_->CheckUnchanged();
    for (size_t i = 0; i < ports.size(); ++i) {
      const StoredChannel* const channel = of_port_[i];
      if (channel == nullptr) continue;
      const auto rows = channel->ticks.size();
      const auto row = static_cast<size_t>(tick.index) % rows;
      // The header is the new run's.
      const size_t header = 8 + 4 * ports[i].counts.size() + 24;
      std::memcpy(ports[i].bytes.data() + header, run_->Message(*channel, row) + header,
                  ports[i].bytes.size() - header);
    }
  }

 private:
  std::shared_ptr<const RunStore> run_;
  std::map<std::string, std::string> channels_;
  std::vector<const StoredChannel*> of_port_;
};

}  // namespace

/// Holds the session for one call.
class Session::Lock {
 public:
  explicit Lock(Session* session) : session_(session) {
    if (session->holder_.load() == std::this_thread::get_id()) {
      throw ConfigError("a component may not call the environment that steps it");
    }
    session->mutex_.lock();
    session->holder_.store(std::this_thread::get_id());
  }
  ~Lock() {
    session_->holder_.store({});
    session_->mutex_.unlock();
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  Session* session_;
};

void Session::Replace(const SessionOptions& options, ComponentRegistry* registry) {
  std::map<std::string, std::shared_ptr<ForeignFunctions>> replaced = options.replaced;
  Graph& graph = *spec_.mutable_graph();
  if (options.plant) {
    for (ComponentInstance& instance : *graph.mutable_component()) {
      if (Components().TraitsOf(TypeOf(instance)).engine.empty()) continue;
      std::map<std::string, std::string> channels;
      for (const auto& output : instance.output()) channels[output.port()] = output.channel();
      replaced[instance.name()] = std::make_shared<RecordedPlant>(options.plant, channels);
    }
  }
  for (const auto& [name, type] : Components().entries()) registry->Add(type);
  for (const auto& [name, functions] : replaced) {
    const auto same = [&, of = &name](const auto& instance) { return instance.name() == *of; };
    auto* const all = graph.mutable_component();
    const auto found = std::find_if(all->begin(), all->end(), same);
    if (found == all->end()) {
      throw ConfigError(fmt::format("graph {}: has no component '{}'; it has {}", graph.name(),
                                    name, Joined(NamesOf(graph.component()), ", ")));
    }
    const ComponentType* const former = registry->TypeNamed(TypeOf(*found));
    if (former == nullptr) {
      throw ConfigError(fmt::format("graph {}: component '{}' is of the unknown type '{}'",
                                    graph.name(), name, TypeOf(*found)));
    }
    ComponentType type = *former;
    // An operator's acts are for who declares them.
    std::erase_if(type.ports, [](const PortType& port) { return port.type == kActType; });
    for (int i = found->input_size(); i-- > 0;) {
      const auto is_acts = [&](const Channel& channel) {
        return channel.name() == found->input(i).channel() && channel.type() == kActType;
      };
      if (std::any_of(graph.channel().begin(), graph.channel().end(), is_acts)) {
        found->mutable_input()->DeleteSubrange(i, 1);
      }
    }
    type.name = "foreign_" + name;
    type.make = [ports = type.ports, functions] {
      return std::make_unique<ForeignComponent>(ports, functions);
    };
    found->set_type(type.name);
    registry->Add(std::move(type));
  }
}

Session::Session(SessionOptions options) : keep_(options.keep) {
  LoadModules();
  Components();
  const LoadedScenario loaded = LoadScenario(options.scenario, options.changes);
  spec_ = MakeRunSpec(loaded, options.changes);
  if (options.endless) spec_.set_num_ticks(0);
  scenario_ = ScenarioText(loaded.scenario);
  model_ = std::make_shared<robot::RobotModel>(robot::LoadRobotFiles(loaded.robot_file));
  const bool replaces = !options.replaced.empty() || options.plant;
  ComponentRegistry registry;
  if (replaces) Replace(options, &registry);
  const std::string program = OwnProgramOf(spec_.graph());
  if (!program.empty()) {
    throw ConfigError(
        program +
        ", which this process cannot hold; give an object in its place, components={name: "
        "object}, or run it with poise run");
  }
  // Where nothing is replaced, an error names file and line.
  BoundGraph graph = replaces ? BoundGraph(spec_, registry) : ConfigureRun(loaded, &spec_);
  FillPlan(graph.plan(), spec_.mutable_graph());
  warnings_ = WarningsOf(spec_, graph);
  runner_ = std::make_unique<InlineRunner>(spec_, std::move(graph));
  names_ = logging::ElementNames::OfSpec(spec_);
  for (int i = 0; i < runner_->graph().num_components(); ++i) {
    Component* const component = runner_->graph().component(i).component.get();
    if (auto* const foreign = dynamic_cast<ForeignComponent*>(component)) {
      foreign_.push_back(foreign);
    }
  }
  override_.assign(static_cast<size_t>(model_->num_joints()),
                   std::numeric_limits<double>::quiet_NaN());
  const GraphPlan& plan = runner_->plan();
  written_.assign(plan.channels.size(), false);
  for (const ComponentInstance& instance : spec_.graph().component()) {
    replaced_.push_back(options.replaced.contains(instance.name()));
  }
  for (size_t c = 0; c < plan.channels.size(); ++c) {
    const MessageType* const type = FindMessageType(plan.channels[c].type);
    layouts_.push_back(type == nullptr || type->has_strings
                           ? nullptr
                           : std::make_unique<MessageLayout>(*type, plan.channels[c].counts));
    if (plan.channels[c].type == "joint_command_t" && command_channel_ < 0) {
      command_channel_ = static_cast<int>(c);
    }
    if (plan.channels[c].type == "bridge_status_t" && status_channel_ < 0) {
      status_channel_ = static_cast<int>(c);
    }
  }
  for (size_t c = 0; status_channel_ >= 0 && c < plan.channels.size(); ++c) {
    const int bridge = plan.channels[static_cast<size_t>(status_channel_)].writer.component;
    if (plan.channels[c].type == "drive_command_t" && plan.channels[c].writer.component == bridge) {
      drive_channel_ = static_cast<int>(c);
    }
  }
  const run_info_t info = logging::MakeRunInfo(spec_, scenario_);
  if (keep_ == SessionOptions::Keep::kFolder) {
    dir_.emplace(MakeRunDir(options.out, spec_.scenario(), options.force));
    WriteRunFiles(dir_->path(), info);
    log_ = dir_->path() / "run.lcm";
    recorder_ = std::make_unique<logging::InlineRecorder>(log_, spec_, info, runner_.get());
  } else if (keep_ == SessionOptions::Keep::kMemory) {
    store_ = std::make_shared<RunStore>(spec_, scenario_);
    record_ = std::make_unique<logging::InlineRecord>(spec_, info, runner_.get());
  }
  runner_->set_tap([this](int channel, const OutputPort& output, const Tick& tick) {
    written_[static_cast<size_t>(channel)] = true;
    if (channel == command_channel_) {
      Override(const_cast<joint_command_t*>(static_cast<const joint_command_t*>(output.message())));
    }
    if (channel == status_channel_) {
      NoteCuts(*static_cast<const bridge_status_t*>(output.message()), tick.time);
    }
    if (recorder_) recorder_->Add(channel, output, tick);
    if (store_) store_->Add(channel, tick.index, output);
    if (record_) record_->Add(channel, output, tick);
  });
  runner_->set_external_tap([this](int channel, std::span<const uint8_t> data) {
    if (recorder_) recorder_->AddExternal(channel, data);
    if (port_) port_->Hear(channel, data);
  });
}

Session::~Session() = default;

int64_t Session::Step(int64_t ticks) {
  const Lock lock(this);
  if (finished_) throw ConfigError("the run is finished; make a new environment, or reset it");
  int64_t done = 0;
  while (done < ticks && !runner_->ended()) {
    const int64_t before = runner_->ticks_completed();
    runner_->Step();
    done += runner_->ticks_completed() - before;
    if (runner_->ticks_completed() == before) break;
  }
  for (ForeignComponent* const foreign : foreign_) {
    if (foreign->error()) std::rethrow_exception(foreign->error());
  }
  ThrowRefusals();
  return done;
}

void Session::Push(const std::string& body, const Eigen::Vector3d& force,
                   const Eigen::Vector3d& point, int64_t ticks) {
  OperatorAct act;
  act.kind = OperatorAct::Kind::kPush;
  act.name = body;
  act.force = force;
  act.point = point;
  act.duration = static_cast<double>(ticks) * spec_.tick_period();
  Do(std::move(act));
}

void Session::Walk(std::optional<Eigen::Vector3d> velocity) {
  OperatorAct act;
  act.kind = velocity ? OperatorAct::Kind::kWalk : OperatorAct::Kind::kStopWalking;
  act.velocity = velocity.value_or(Eigen::Vector3d::Zero());
  Do(std::move(act));
}

void Session::Move(const std::string& joint, double angle, double duration) {
  OperatorAct act;
  act.kind = OperatorAct::Kind::kMove;
  act.name = joint;
  act.value = angle;
  act.duration = duration;
  Do(std::move(act));
}

void Session::Do(OperatorAct act) {
  const Lock lock(this);
  if (!port_) {
    port_ = std::make_unique<InlinePort>(spec_);
    port_->SetRunner(runner_.get());
  }
  act.id = next_act_++;
  port_->Do(std::move(act));
  ThrowRefusals();
}

void Session::ThrowRefusals() {
  if (!port_) return;
  for (const OperatorAct& answer : port_->TakeAnswers()) {
    if (answer.state != OperatorAct::State::kRefused) continue;
    throw ConfigError(fmt::format("{}: {}", ActName(answer.kind), answer.reason));
  }
}

void Session::OverrideTorque(int joint, std::optional<double> torque) {
  const Lock lock(this);
  if (joint < 0 || joint >= static_cast<int>(override_.size())) {
    throw ConfigError(
        fmt::format("joint {}: the robot has joints 0 to {}", joint, override_.size() - 1));
  }
  if (command_channel_ < 0) throw ConfigError("the graph has no joint_command_t");
  if (torque && !std::isfinite(*torque)) throw ConfigError("torque: must be a finite number");
  override_[static_cast<size_t>(joint)] = torque.value_or(std::numeric_limits<double>::quiet_NaN());
  overrides_ = std::ranges::any_of(override_, [](double t) { return !std::isnan(t); });
}

void Session::SetCommand(std::optional<Command> command) {
  const Lock lock(this);
  if (command_channel_ < 0) throw ConfigError("the graph has no joint_command_t");
  std::optional<joint_command_t> whole;  // the rest would tell of the controller's own torque
  if (command) {
    const auto check = [&](const char* field, const std::vector<double>& values, bool negative) {
      if (values.size() != override_.size()) {
        throw ConfigError(fmt::format("{}: has {} numbers, the robot {} joints", field,
                                      values.size(), override_.size()));
      }
      for (const double value : values) {
        if (std::isfinite(value) && (negative || value >= 0)) continue;
        throw ConfigError(fmt::format("{}: {} is not a finite number{}", field, value,
                                      negative ? "" : ", 0 or more"));
      }
    };
    check("torque", command->torque, true);
    check("position", command->position, true);
    check("velocity", command->velocity, true);
    check("stiffness", command->stiffness, false);
    check("damping", command->damping, false);
    MessageTraits<joint_command_t>::Resize(
        whole.emplace(), runner_->plan().channels[static_cast<size_t>(command_channel_)].counts);
    whole->torque = std::move(command->torque);
    whole->position = std::move(command->position);
    whole->velocity = std::move(command->velocity);
    whole->stiffness = std::move(command->stiffness);
    whole->damping = std::move(command->damping);
  }
  command_ = std::move(whole);
}

void Session::Override(joint_command_t* command) {
  if (command_) {
    command_->run_id = command->run_id;
    command_->tick = command->tick;
    command_->utime = command->utime;
    *command = *command_;
  }
  if (!overrides_) return;
  for (size_t j = 0; j < override_.size() && j < command->torque.size(); ++j) {
    if (!std::isnan(override_[j])) command->torque[j] = override_[j];
  }
}

void Session::NoteCuts(const bridge_status_t& status, double time) {
  if (command_channel_ < 0 || drive_channel_ < 0) return;
  const OutputPort *const command = Writer(command_channel_), *const drive = Writer(drive_channel_);
  if (command == nullptr || drive == nullptr) return;
  for (size_t joint = 0; joint < status.saturated.size(); ++joint) {
    if ((status.saturated[joint] & bridge_status_t::LIMIT_IMPEDANCE) == 0) continue;
    const logging::ImpedanceCut cut =
        logging::CutOf(*static_cast<const joint_command_t*>(command->message()),
                       *static_cast<const drive_command_t*>(drive->message()), joint);
    if (!cut.counts()) continue;
    Cut& noted = cuts_.try_emplace(joint, Cut{time, {}}).first->second;
    if (cut.share > noted.largest.share) noted.largest = cut;
  }
}

int Session::FindChannel(const std::string& name) const {
  const std::vector<GraphPlan::ChannelPlan>& channels = runner_->plan().channels;
  const auto found = std::ranges::find(channels, name, &GraphPlan::ChannelPlan::name);
  if (found == channels.end()) {
    std::string names;
    for (const auto& channel : channels) names += (names.empty() ? "" : ", ") + channel.name;
    throw ConfigError(fmt::format("there is no channel '{}'; there are {}", name, names));
  }
  const auto index = static_cast<int>(found - channels.begin());
  if (!layouts_[static_cast<size_t>(index)]) {
    throw ConfigError(fmt::format("{}: its messages hold texts", name));
  }
  return index;
}

const OutputPort* Session::Writer(int channel) {
  const GraphPlan::Endpoint& writer = runner_->plan().channels[static_cast<size_t>(channel)].writer;
  if (writer.component < 0) return nullptr;
  return runner_->graph()
      .component(writer.component)
      .wiring.outputs()[static_cast<size_t>(writer.port)];
}

std::vector<uint8_t> Session::Message(const std::string& channel) {
  const Lock lock(this);
  const int index = FindChannel(channel);
  const OutputPort* const port = Writer(index);
  if (port == nullptr) throw ConfigError(fmt::format("{}: nobody in the graph writes it", channel));
  if (runner_->ticks_completed() == 0) {
    runner_->BeginTick([&](int component) {
      return replaced_[static_cast<size_t>(component)] ||
             (command_channel_ >= 0 &&
              component ==
                  runner_->plan().channels[static_cast<size_t>(command_channel_)].writer.component);
    });
  }
  if (!written_[static_cast<size_t>(index)]) {
    throw ConfigError(
        fmt::format("{}: has no message before the first tick's command; call step", channel));
  }
  std::vector<uint8_t> bytes(static_cast<size_t>(port->encoded_size()));
  port->Encode(bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

const MessageLayout& Session::Layout(const std::string& channel) const {
  return *layouts_[static_cast<size_t>(FindChannel(channel))];
}

const MessageType& Session::Type(const std::string& channel) const {
  return *FindMessageType(runner_->plan().channels[static_cast<size_t>(FindChannel(channel))].type);
}

std::vector<std::string> Session::Channels() const {
  std::vector<std::string> names;
  for (size_t c = 0; c < layouts_.size(); ++c) {
    const GraphPlan::ChannelPlan& channel = runner_->plan().channels[c];
    if (layouts_[c] && !channel.external) names.push_back(channel.name);
  }
  return names;
}

std::shared_ptr<const RunStore> Session::Finish() {
  const Lock lock(this);
  if (!finished_) {
    finished_ = true;
    if (recorder_) {
      recorder_->Close(spec_);
      store_ = std::make_shared<RunStore>(log_);
      dir_.reset();
    } else if (record_) {
      store_->Finish(record_->Take());
    }
    recorder_.reset();
    record_.reset();
  }
  return store_;
}

int64_t Session::tick() {
  const Lock lock(this);
  return runner_->ticks_completed();
}

double Session::time() {
  const Lock lock(this);
  return MakeTick(std::max<int64_t>(runner_->ticks_completed() - 1, 0), spec_.tick_period(),
                  spec_.lead_ticks())
      .time;
}

bool Session::ended() {
  const Lock lock(this);
  return finished_ || runner_->ended();
}

bool Session::failed() {
  const Lock lock(this);
  return runner_->failed();
}

std::vector<std::string> Session::warnings() {
  const Lock lock(this);
  std::vector<std::string> warnings = warnings_;
  for (const auto& [joint, cut] : cuts_) {
    warnings.push_back(
        fmt::format("hw_bridge cuts what is commanded of {}: {}, from {:.3f} s on; command what "
                    "the robot bears",
                    model_->joints()[joint].name, cut.largest.Text(), cut.since));
  }
  return warnings;
}

std::string Session::detail() {
  const Lock lock(this);
  std::string detail = runner_->end_detail();
  const std::vector<GraphPlan::ChannelPlan>& channels = runner_->plan().channels;
  const auto status = std::ranges::find(channels, "bridge_status_t", &GraphPlan::ChannelPlan::type);
  const auto at = static_cast<size_t>(status - channels.begin());
  if (at >= channels.size() || !written_[at]) return detail;
  const OutputPort* const port = Writer(static_cast<int>(at));
  if (port == nullptr) return detail;
  const auto& bridge = *static_cast<const bridge_status_t*>(port->message());
  if (bridge.state < bridge_status_t::STATE_STOPPING ||
      bridge.reason == bridge_status_t::REASON_SHUTDOWN) {
    return detail;
  }
  return fmt::format("{}{}hw_bridge has stopped the robot: {}", detail, detail.empty() ? "" : "; ",
                     logging::BridgeReasonText(bridge, names_));
}

}  // namespace poise::python
