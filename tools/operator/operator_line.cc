#include "tools/operator/operator_line.h"

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_reference.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/events/operator_words.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

using operate::act_t;
using operate::answer_t;

constexpr int64_t kMillisecondNs = 1'000'000;
constexpr int64_t kRepeatAct = 20 * kMillisecondNs;
constexpr int64_t kPatience = 3000 * kMillisecondNs;  // as long as poise estop's
constexpr int kMostTries = 8;                         // each twice as far ahead as the one before
// s of wall time that an act is sent ahead of its tick, and ticks at least: what a busy machine
// takes to hand it on. An act that is late all the same goes again, farther ahead.
constexpr double kAhead = 0.03;
constexpr int64_t kLeastAhead = 5;
constexpr double kMostWeights = 10;  // a push beyond is a slip of the hand: no robot withstands one

int ChannelOfType(const Graph& graph, std::string_view type) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type) return i;
  }
  return -1;
}

std::string Why(const answer_t& answer, const LiveField* field) {
  switch (answer.verdict) {
    case answer_t::VERDICT_LATE:
      return "the run goes so fast that each try came too late; try again, or run with --realtime";
    case answer_t::VERDICT_RANGE:
      if (field == nullptr) break;
      return fmt::format("is outside {:.6g} to {:.6g} {}", field->least, field->most, field->unit);
    default:
      break;
  }
  return logging::RefusalReason(answer.kind, answer.verdict);
}

/// The run, if it takes acts of an operator. Throws ConfigError.
const RunSpec& Operable(const RunSpec& spec) {
  if (spec.first_port() == 0) {
    throw ConfigError(
        fmt::format("run {}: runs inside one process, which hears nobody: use its page, if it is "
                    "interactive, or start it without --inline",
                    spec.run_id()));
  }
  const Graph& graph = spec.graph();
  if (ChannelOfType(graph, kActType) < 0 || ChannelOfType(graph, kAnswerType) < 0) {
    throw ConfigError(
        fmt::format("graph {}: has no channels of type {} and {}; its runs take no "
                    "acts of an operator",
                    graph.name(), kActType, kAnswerType));
  }
  return spec;
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
    const auto* const operated = dynamic_cast<const Operated*>(configured.component.get());
    if (operated == nullptr) continue;
    std::vector<FieldEntry> entries;
    if (type->schema != nullptr && type->config != nullptr) {
      AddSchema(type->schema());
      entries = FieldsOfType(std::string(type->config->full_name()));
    }
    for (const LiveSetting& setting : operated->live_settings().all()) {
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

OperatorLine::OperatorLine(RunSpec spec)
    : spec_(std::move(spec)), socket_(RunSocket::Ask(Operable(spec_))) {
  const Graph& graph = spec_.graph();
  const int acts = ChannelOfType(graph, kActType), answers = ChannelOfType(graph, kAnswerType);
  fields_ = LiveFields(spec_);
  targets_ = FindActTargets(spec_);
  channel_ = graph.channel(acts).name();
  sender_ = std::make_unique<RunSender>(socket_, ChannelUrl(spec_, acts));
  answers_ = std::make_unique<BusReceiver>(ChannelUrl(spec_, answers), OfRun(spec_));
  int ticks = ChannelOfType(graph, "bridge_status_t");
  for (int i = 0; ticks < 0 && i < graph.channel_size(); ++i) {
    if (!graph.channel(i).external()) ticks = i;
  }
  if (ticks < 0) throw ConfigError(fmt::format("graph {}: has no channel", graph.name()));
  tick_channel_ = graph.channel(ticks).name();
  const MessageType* const type = FindMessageType(graph.channel(ticks).type());
  if (type == nullptr) {
    throw ConfigError(fmt::format("channel {}: this program does not know {}", tick_channel_,
                                  graph.channel(ticks).type()));
  }
  tick_offset_ = type->run_id_offset;
  ticks_ = std::make_unique<BusReceiver>(ChannelUrl(spec_, ticks), OfRun(spec_));
  std::random_device random;
  next_id_ = static_cast<int64_t>((uint64_t{random()} << 31) ^ random()) + 1;
}

std::array<int, 2> OperatorLine::fds() const { return {answers_->fd(), ticks_->fd()}; }

const LiveField& OperatorLine::Field(const std::string& path) const {
  const auto found = std::ranges::find(fields_, path, &LiveField::path);
  if (found != fields_.end()) return *found;
  std::vector<std::string> names;
  for (const LiveField& field : fields_) names.push_back(field.path);
  throw ConfigError(fmt::format("{}: is no field that can be set while the run goes on; {}",

                                path, Suggest(path, names)));
}

int64_t OperatorLine::Add(act_t act) {
  act.run_id = spec_.run_id();
  act.id = next_id_++;
  const int64_t id = act.id;
  Pending pending;
  pending.act = act;
  pending.since = NowNanoseconds();
  pending_.emplace(id, pending);
  return id;
}

int64_t OperatorLine::Push(const std::string& body, const Eigen::Vector3d& force,
                           const Eigen::Vector3d& point, double duration) {
  if (targets_.simulator < 0) {
    throw ConfigError("push: nothing is simulated here that could be pushed");
  }
  if (!force.allFinite() || !point.allFinite() || !std::isfinite(duration)) {
    throw ConfigError("push: force, point and duration must be finite numbers");
  }
  const double most = kMostWeights * targets_.weight;
  if (force.norm() > most) {
    throw ConfigError(
        fmt::format("push: {:.6g} N is more than {:.0f} N, {:.0f} times the robot's "
                    "weight",
                    force.norm(), most, kMostWeights));
  }
  const auto found =
      body.empty() ? targets_.bodies.begin() : std::ranges::find(targets_.bodies, body);
  if (found == targets_.bodies.end()) {
    throw ConfigError(fmt::format("push: no moving body '{}'; use one of {}", body,
                                  fmt::join(targets_.bodies, ", ")));
  }
  act_t act{};
  act.component = targets_.simulator;
  act.kind = act_t::KIND_PUSH;
  act.body = static_cast<int32_t>(found - targets_.bodies.begin());
  for (int i = 0; i < 3; ++i) {
    act.force[i] = force[i];
    act.point[i] = point[i];
  }
  const double ticks = std::min(duration / spec_.tick_period(), 1e9);
  act.duration = duration < 0 ? -1 : std::max<int64_t>(1, std::llround(ticks));
  return Add(act);
}

int64_t OperatorLine::Set(const std::string& path, double value) {
  const LiveField& field = Field(path);
  if (!(value >= field.least && value <= field.most)) {
    throw ConfigError(fmt::format("{}: {:.6g} is outside {:.6g} to {:.6g} {}", path, value,
                                  field.least, field.most, field.unit));
  }
  act_t act{};
  act.component = field.component;
  act.kind = act_t::KIND_SETTING;
  const std::string name = path.substr(path.find('.') + 1);
  std::copy(name.begin(), name.end(), act.field);  // LiveSettings::Add has checked its length
  act.value = value;
  return Add(act);
}

int64_t OperatorLine::Ask(const std::string& path) {
  const LiveField& field = Field(path);
  act_t act{};
  act.component = field.component;
  act.kind = act_t::KIND_ASK;
  const std::string name = path.substr(path.find('.') + 1);
  std::copy(name.begin(), name.end(), act.field);
  return Add(act);
}

int64_t OperatorLine::Plan(act_t act) {
  if (targets_.planner < 0)
    throw ConfigError("this graph has no planner that takes an operator's acts");
  act.component = targets_.planner;
  return Add(act);
}

int64_t OperatorLine::Step(const std::string& foot) {
  act_t act{};
  act.kind = act_t::KIND_STEP;
  act.foot = -1;
  if (!foot.empty()) {
    const auto found = std::ranges::find(targets_.feet, foot);
    if (found == targets_.feet.end()) {
      throw ConfigError(
          fmt::format("step: no foot '{}'; use one of {}", foot, fmt::join(targets_.feet, ", ")));
    }
    act.foot = static_cast<int8_t>(found - targets_.feet.begin());
  }
  return Plan(act);
}

int64_t OperatorLine::Walk(double ahead, double left, double turn) {
  act_t act{};
  act.kind = act_t::KIND_WALK;
  const double velocity[3] = {ahead, left, turn};
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(velocity[i]) <= 1)) {
      constexpr const char* kWhat[3] = {"velocity ahead", "velocity to the left", "turn"};
      throw ConfigError(fmt::format("walk: {} is {}; must lie between -1 and 1 {}", kWhat[i],
                                    velocity[i], i < 2 ? "m/s" : "rad/s"));
    }
    act.velocity[i] = velocity[i];
  }
  return Plan(act);
}

int64_t OperatorLine::Stand() {
  act_t act{};
  act.kind = act_t::KIND_STAND;
  return Plan(act);
}

int64_t OperatorLine::NextPhase() {
  act_t act{};
  act.kind = act_t::KIND_NEXT_PHASE;
  return Plan(act);
}

void OperatorLine::Send(Pending* pending, int64_t now) {
  act_t& act = pending->act;
  if (pending->sent == 0) {
    const double heard = static_cast<double>(tick_time_ - first_time_) * 1e-9;
    // As fast as the run has gone; at first as real time.
    const double rate =
        heard > 0.05 ? static_cast<double>(tick_ - first_tick_) / heard : 1 / spec_.tick_period();
    const double since = static_cast<double>(now - tick_time_) * 1e-9;
    const auto ahead = static_cast<int64_t>(std::ldexp(kAhead + since, pending->tries) * rate);
    act.tick = tick_ + kLeastAhead + ahead;
  }
  pending->sent = now;
  std::vector<uint8_t> bytes(static_cast<size_t>(act.getEncodedSize()));
  act.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  sender_->Send(channel_, bytes.data(), bytes.size());
}

void OperatorLine::Hear() {
  BusReceiver::Packet packet;
  const int64_t now = NowNanoseconds();
  while (ticks_->Receive(&packet)) {
    const auto at = static_cast<size_t>(tick_offset_);
    if (packet.channel != tick_channel_ || packet.size < at + 16 ||
        ReadInt64(packet.data + at) != spec_.run_id()) {
      continue;
    }
    tick_ = std::max(tick_, ReadInt64(packet.data + at + 8));
    tick_time_ = now;
    if (first_tick_ < 0) {
      first_tick_ = tick_;
      first_time_ = now;
    }
  }
  while (answers_->Receive(&packet)) {
    answer_t answer;
    if (!DecodeChecked(packet.data, static_cast<int64_t>(packet.size), &answer) ||
        answer.run_id != spec_.run_id()) {
      continue;
    }
    for (auto& [id, pending] : pending_) {
      if (pending.act.id != answer.id || pending.act.component != answer.component ||
          pending.outcome) {
        continue;
      }
      if (answer.verdict == answer_t::VERDICT_LATE && ++pending.tries < kMostTries) {
        pending.act.id = next_id_++;  // another act, since that one is refused for good
        pending.sent = 0;
        continue;
      }
      ActOutcome outcome;
      outcome.verdict = answer.verdict;
      outcome.done = answer.verdict == answer_t::VERDICT_DONE;
      outcome.tick = answer.tick;
      outcome.time = MakeTick(answer.tick, spec_.tick_period(), spec_.lead_ticks()).time;
      outcome.value = answer.value;
      const LiveField* field = nullptr;
      for (const LiveField& each : fields_) {
        const std::string name = each.path.substr(each.path.find('.') + 1);
        const auto* const text = reinterpret_cast<const char*>(pending.act.field);
        if (each.component == answer.component &&
            name == std::string_view(text, strnlen(text, sizeof pending.act.field))) {
          field = &each;
        }
      }
      if (!outcome.done) outcome.text = Why(answer, field);
      pending.outcome = outcome;
    }
  }
}

void OperatorLine::Update(int timeout_ms) {
  pollfd fds[] = {{answers_->fd(), POLLIN, 0}, {ticks_->fd(), POLLIN, 0}};
  // Ticks wake too often to be waited for once they are known.
  const bool waits = tick_ < 0;
  poll(fds, waits ? 2 : 1, timeout_ms);
  Hear();
  const int64_t now = NowNanoseconds();
  for (auto& [id, pending] : pending_) {
    if (pending.outcome) continue;
    if (now - pending.since > kPatience) {
      ActOutcome outcome;
      outcome.text = tick_ < 0 ? "no tick of the run was heard for 3 s; has it ended, or not begun?"
                               : "nobody has answered for 3 s; has the run ended?";
      pending.outcome = outcome;
      continue;
    }
    if (tick_ >= 0 && (pending.sent == 0 || now - pending.sent > kRepeatAct)) {
      Send(&pending, now);
    }
  }
}

std::optional<ActOutcome> OperatorLine::TakeOutcome(int64_t id) {
  const auto found = pending_.find(id);
  if (found == pending_.end() || !found->second.outcome) return {};
  ActOutcome outcome = std::move(*found->second.outcome);
  pending_.erase(found);
  return outcome;
}

ActOutcome OperatorLine::Wait(int64_t id) {
  while (true) {
    if (std::optional<ActOutcome> outcome = TakeOutcome(id)) return *outcome;
    Update(10);
  }
}

}  // namespace poise
