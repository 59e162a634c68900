#include "tools/operator/act_port.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "components/balance/joint_limits.h"
#include "components/balance/whole_body.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_reference.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "logging/events/operator_words.h"
#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

using operate::act_t;
using operate::answer_t;
using ActKind = OperatorAct::Kind;

// At most so many acts and stops wait for an answer. A stop is under way when the first of them is:
// what is more comes of one hand.
constexpr std::ptrdiff_t kMostActs = 128, kMostStops = 32;

/// -1: the graph has none.
int ChannelOf(const Graph& graph, std::string_view type, bool external) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type && graph.channel(i).external() == external) return i;
  }
  return -1;
}

/// The channel at a component's input for acts; empty: it has none.
std::string ActChannel(const Graph& graph, int component) {
  for (const Connection& input : graph.component(component).input()) {
    for (const Channel& channel : graph.channel()) {
      if (channel.name() == input.channel() && channel.type() == kActType) return channel.name();
    }
  }
  return {};
}

std::string FieldName(const std::string& path) { return path.substr(path.find('.') + 1); }

int IndexOf(const std::vector<std::string>& names, const std::string& name, const char* what) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) {
    throw ConfigError(fmt::format("{} '{}'; use one of {}", what, name, fmt::join(names, ", ")));
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace

std::vector<LiveField> LiveFields(const RunSpec& spec) {
  std::vector<LiveField> fields;
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    const ComponentInstance& instance = spec.graph().component(i);
    const ComponentType* const type = Components().TypeNamed(TypeOf(instance));
    // An engine's world is not made for its settings, of which it has none.
    if (type == nullptr || !type->traits.engine.empty()) continue;
    const auto is_acts = [](const PortType& port) { return port.type == kActType; };
    if (std::ranges::none_of(type->ports, is_acts) || ActChannel(spec.graph(), i).empty()) continue;
    SharedObjects shared;
    const ConfiguredComponent configured = ConfigureComponent(spec, i, type->make, &shared);
    std::vector<FieldEntry> entries;
    if (type->schema != nullptr && type->config != nullptr) {
      AddSchema(type->schema());
      entries = FieldsOfType(std::string(type->config->full_name()));
    }
    for (const LiveSetting& setting : LiveSettingsOf(configured.wiring)) {
      LiveField field;
      field.component = i;
      field.path = instance.name() + "." + setting.field;
      field.least = setting.least;
      field.most = setting.most;
      field.ramp = setting.ramp;
      field.value = *setting.value;
      const auto entry = std::ranges::find(entries, setting.field, &FieldEntry::path);
      if (entry != entries.end()) {
        field.unit = entry->unit;
        field.meaning = entry->meaning;
      }
      fields.push_back(std::move(field));
    }
  }
  return fields;
}

ActPort::ActPort(RunSpec spec)
    : act_channel_(ChannelOf(spec.graph(), kActType, true)),
      answer_channel_(ChannelOf(spec.graph(), kAnswerType, true)),
      stop_channel_(ChannelOf(spec.graph(), "emergency_stop_t", true)),
      status_channel_(ChannelOf(spec.graph(), "bridge_status_t", false)),
      spec_(std::move(spec)) {}

void ActPort::RequireActs() const {
  if (act_channel_ >= 0 && answer_channel_ >= 0) return;
  throw ConfigError(
      fmt::format("graph {}: has no channels of type {} and {}; its runs take no "
                  "acts of an operator",
                  spec_.graph().name(), kActType, kAnswerType));
}

const std::vector<LiveField>& ActPort::fields() const {
  RequireActs();
  if (!fields_) fields_ = LiveFields(spec_);
  return *fields_;
}

const ActPort::Targets& ActPort::targets() const {
  if (targets_) return *targets_;
  const Graph& graph = spec_.graph();
  Targets targets;
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentType* const type = Components().TypeNamed(TypeOf(graph.component(i)));
    if (type == nullptr || ActChannel(graph, i).empty()) continue;
    if (!type->traits.engine.empty()) targets.simulator = i;
    for (const PortType& port : type->ports) {
      if (!port.input && port.type == "support_plan_t") targets.planner = i;
      if (!port.input && port.type == "task_torque_t") targets.tasks = i;
    }
  }
  const robot::RobotModel model =
      robot::LoadRobotTexts(ResourceOf(spec_, "robot").text(), ResourceOf(spec_, "urdf").text());
  targets.weight = model.total_mass() * robot::kGravity;
  for (const auto& body : model.bodies()) targets.bodies.push_back(body.name);
  for (const auto& foot : model.feet()) targets.feet.push_back(foot.name);
  const balance::ContactDynamics dynamics = balance::MakeContactDynamics(model);
  for (const auto& joint : model.joints()) {
    const auto index = static_cast<int>(targets.joints.size());
    const bool leg = std::ranges::find(dynamics.legs(), index) != dynamics.legs().end();
    if (!leg && targets.tasks >= 0) {
      const balance::PositionRange range(joint);
      targets.movable.push_back({joint.name, range.lower, range.upper});
    }
    targets.joints.push_back(joint.name);
  }
  return targets_.emplace(std::move(targets));
}

const LiveField& ActPort::Field(const std::string& path) const {
  const auto found = std::ranges::find(fields(), path, &LiveField::path);
  if (found != fields().end()) return *found;
  std::vector<std::string> names;
  for (const LiveField& field : fields()) names.push_back(field.path);
  throw ConfigError(fmt::format("{}: is no field that can be set while the run goes on; {}", path,
                                Suggest(path, names)));
}

int64_t ActPort::TicksOf(double duration) const {
  return std::max<int64_t>(1, std::llround(std::min(duration / spec_.tick_period(), 1e9)));
}

act_t ActPort::MessageOf(const OperatorAct& act) const {
  RequireActs();
  act_t message{};
  message.run_id = spec_.run_id();
  message.kind = MessageKind(act.kind);
  switch (act.kind) {
    case ActKind::kPush: {
      if (targets().simulator < 0) {
        throw ConfigError("push: nothing is simulated here that could be pushed");
      }
      if (!act.force.allFinite() || !act.point.allFinite() || !std::isfinite(act.duration)) {
        throw ConfigError("push: force, point and duration must be finite numbers");
      }
      message.component = targets().simulator;
      message.body =
          act.name.empty() ? 0 : IndexOf(targets().bodies, act.name, "push: no moving link");
      for (int i = 0; i < 3; ++i) {
        message.force[i] = act.force[i];
        message.point[i] = act.point[i];
      }
      message.duration = act.duration < 0 ? -1 : TicksOf(act.duration);
      return message;
    }
    case ActKind::kMove:
      if (targets().tasks < 0) {
        throw ConfigError("move: this graph has no controller that takes an operator's acts");
      }
      if (!std::isfinite(act.value) || !(act.duration >= 0)) {
        throw ConfigError("move: the angle must be a finite number, the duration 0 s or more");
      }
      message.component = targets().tasks;
      message.body = IndexOf(targets().joints, act.name, "move: no joint");
      message.value = act.value;
      message.duration = TicksOf(act.duration);
      return message;
    case ActKind::kSet:
    case ActKind::kAsk: {
      const LiveField& field = Field(act.name);
      if (act.kind == ActKind::kSet && !(act.value >= field.least && act.value <= field.most)) {
        throw ConfigError(fmt::format("{}: {:.6g} is outside {:.6g} to {:.6g} {}", act.name,
                                      act.value, field.least, field.most, field.unit));
      }
      message.component = field.component;
      const std::string name = FieldName(act.name);
      std::ranges::copy(name, message.field);  // LiveSettings::Add has checked its length
      message.value = act.value;
      return message;
    }
    case ActKind::kStep:
      message.foot = static_cast<int8_t>(
          act.name.empty() ? -1 : IndexOf(targets().feet, act.name, "step: no foot"));
      break;
    case ActKind::kWalk:
      for (int i = 0; i < 3; ++i) {
        if (!(std::abs(act.velocity[i]) <= 1)) {
          constexpr const char* kWhat[3] = {"velocity ahead", "velocity to the left", "turn"};
          throw ConfigError(fmt::format("walk: {} is {}; must lie between -1 and 1 {}", kWhat[i],
                                        act.velocity[i], i < 2 ? "m/s" : "rad/s"));
        }
        message.velocity[i] = act.velocity[i];
      }
      break;
    default:
      break;
  }
  if (targets().planner < 0) {
    throw ConfigError("this graph has no planner that takes an operator's acts");
  }
  message.component = targets().planner;
  return message;
}

std::string ActPort::WhyNot(ActKind kind) const {
  if (MessageKind(kind) != 0) return {};
  if (kind != ActKind::kStop && kind != ActKind::kReset) return "of an interactive run alone";
  if (stop_channel_ >= 0 && status_channel_ >= 0) return {};
  return "this graph has no bridge that could stop";
}

void ActPort::Do(OperatorAct act) {
  if (const std::string why = WhyNot(act.kind); !why.empty()) {
    throw ConfigError(fmt::format("{}: {}", ActName(act.kind), why));
  }
  const auto waits = [&](const auto& which) {
    return std::ranges::count_if(waiting_, [&](const Waiting& each) { return which(each.act); });
  };
  const auto is_stop = [](const OperatorAct& each) { return each.kind == ActKind::kStop; };
  const auto is_persons = [&](const OperatorAct& each) {
    return !is_stop(each) && each.client >= 0;
  };
  const bool stop = is_stop(act);
  if (stop ? waits(is_stop) >= kMostStops : is_persons(act) && waits(is_persons) >= kMostActs) {
    throw ConfigError("too many acts wait already");
  }
  if (act.kind == ActKind::kReset && waits(is_stop) > 0) throw ConfigError("a stop is under way");
  Waiting waiting;
  if (MessageKind(act.kind) != 0) waiting.message = MessageOf(act);
  if (stop || act.kind == ActKind::kReset) {
    Refuse(ActKind::kReset, "another stop or reset has followed");
  }
  waiting.message.id = next_id_++;
  waiting.act = std::move(act);
  waiting_.push_back(std::move(waiting));
  Start(&waiting_.back());
}

bool ActPort::Send(const act_t& message) { return Send(act_channel_, MessageBytes(message)); }

bool ActPort::SendStop(bool stop, bool reset) {
  emergency_stop_t message{};
  message.run_id = spec_.run_id();
  message.stop = stop ? 1 : 0;
  message.reset = reset ? 1 : 0;
  return Send(stop_channel_, MessageBytes(message));
}

void ActPort::Answer(int64_t id, int64_t tick, std::string reason) {
  const auto found = std::ranges::find_if(
      waiting_, [&](const Waiting& waiting) { return waiting.message.id == id; });
  if (found == waiting_.end()) return;
  OperatorAct act = std::move(found->act);
  waiting_.erase(found);
  act.state = reason.empty() ? OperatorAct::State::kAccepted : OperatorAct::State::kRefused;
  act.tick = tick;
  act.reason = std::move(reason);
  if (act.kind == ActKind::kPush && act.state == OperatorAct::State::kAccepted) {
    push_ = act;
    push_until_ = tick + std::llround(act.duration / spec_.tick_period());
  }
  if (Note(act)) answers_.push_back(std::move(act));
}

void ActPort::Refuse(ActKind kind, const std::string& reason) {
  std::vector<int64_t> ids;
  for (const Waiting& waiting : waiting_) {
    if (waiting.act.kind == kind) ids.push_back(waiting.message.id);
  }
  for (const int64_t id : ids) Answer(id, -1, reason);
}

std::string ActPort::Reason(const OperatorAct& act, const answer_t& answer) const {
  if (answer.verdict == answer_t::VERDICT_DONE) return {};
  if (answer.verdict == answer_t::VERDICT_LATE) {
    return "the run goes so fast that each try came too late; try again, or run with --realtime";
  }
  if (answer.verdict == answer_t::VERDICT_RANGE && answer.kind == act_t::KIND_SETTING) {
    const LiveField& field = Field(act.name);
    return fmt::format("is outside {:.6g} to {:.6g} {}", field.least, field.most, field.unit);
  }
  return logging::RefusalReason(answer.kind, answer.verdict);
}

int8_t ActPort::HearAnswer(std::span<const uint8_t> data) {
  answer_t answer;
  if (!DecodeChecked(data, &answer) || answer.run_id != spec_.run_id()) {
    return 0;
  }
  const auto found = std::ranges::find_if(waiting_, [&](const Waiting& waiting) {
    return waiting.message.id == answer.id && waiting.message.component == answer.component;
  });
  if (found == waiting_.end()) return answer.kind;
  if (answer.verdict == answer_t::VERDICT_LATE && Again(&*found)) return answer.kind;
  const bool tells = found->act.kind == ActKind::kSet || found->act.kind == ActKind::kAsk;
  if (tells && answer.verdict == answer_t::VERDICT_DONE) found->act.value = answer.value;
  Answer(answer.id, answer.tick, Reason(found->act, answer));
  return answer.kind;
}

void ActPort::HearStatus(std::span<const uint8_t> data) {
  bridge_status_t status;
  if (!DecodeChecked(data, &status) || status.run_id != spec_.run_id()) {
    return;
  }
  stopped_ = status.state >= bridge_status_t::STATE_STOPPING;
  resets_ = status.resets;
  std::vector<int64_t> done;
  for (Waiting& waiting : waiting_) {
    const bool resets = waiting.act.kind == ActKind::kReset;
    if (resets && waiting.resets < 0) waiting.resets = resets_;
    if ((waiting.act.kind == ActKind::kStop && stopped_) || (resets && resets_ > waiting.resets)) {
      done.push_back(waiting.message.id);
    }
  }
  for (const int64_t id : done) Answer(id, status.tick, {});
}

}  // namespace poise
