#include "tools/live/bus_operator.h"

#include <cmath>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"

namespace poise {
namespace {

constexpr std::chrono::milliseconds kStopPatience{3000};
constexpr std::chrono::milliseconds kStopRepeat{20};
constexpr std::chrono::milliseconds kResetLow{200};  // before the edge of a reset
constexpr double kPushShare = 0.5;                   // of the robot's weight
constexpr double kGravity = 9.81;                    // m/s²
constexpr double kLongestPush = 2;                   // s: a page that wants more asks again
constexpr double kFastestWalk = 0.5;                 // m/s and rad/s: what a page offers
constexpr std::chrono::milliseconds kSettled{1000};  // ms, longer than a setting's ramp
constexpr size_t kMostWaiting = 128;                 // acts without an answer

int OperatorChannel(const Graph& graph, std::string_view type, bool external) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type && graph.channel(i).external() == external) return i;
  }
  return -1;
}

}  // namespace

double PagePushLimit(const RunSpec& spec) {
  return std::round(kPushShare * kGravity * RobotOf(spec).total_mass());
}

nlohmann::ordered_json StandingOf(const std::vector<LiveField>& fields,
                                  const std::map<std::string, double>& in_force,
                                  double push_limit) {
  using Json = nlohmann::ordered_json;
  Json settings = Json::array();
  for (const LiveField& field : fields) {
    const auto value = in_force.find(field.path);
    if (value == in_force.end()) continue;  // its component has told nothing yet
    settings.push_back({{"field", field.path},
                        {"unit", field.unit},
                        {"text", field.meaning},
                        {"low", field.least},
                        {"high", field.most},
                        {"ramp", field.ramp},
                        {"value", value->second}});
  }
  const Json fast = {kFastestWalk, kFastestWalk, kFastestWalk};
  const Json slow = {-kFastestWalk, -kFastestWalk, -kFastestWalk};
  return {{"settings", std::move(settings)},
          {"push_limit", push_limit},
          {"push_longest", kLongestPush},
          {"walk", {{"low", slow}, {"high", fast}}}};
}

std::string BeyondPage(const OperatorAct& act, double push_limit) {
  // A rounding beyond the limit is no attack.
  if (act.kind == OperatorAct::Kind::kPush && act.force.norm() > push_limit * (1 + 1e-9)) {
    return fmt::format("{:.0f} N are more than a page may push with, {:.0f} N", act.force.norm(),
                       push_limit);
  }
  if (act.kind == OperatorAct::Kind::kPush && act.duration > kLongestPush) {
    return fmt::format("{:.3g} s are longer than a page may push, {:.3g} s", act.duration,
                       kLongestPush);
  }
  return {};
}

BusOperator::BusOperator(const RunSpec& spec)
    : line_(spec),
      stop_channel_(OperatorChannel(spec.graph(), "emergency_stop_t", true)),
      status_channel_(OperatorChannel(spec.graph(), "bridge_status_t", false)),
      answer_channel_(OperatorChannel(spec.graph(), kAnswerType, true)),
      push_limit_(PagePushLimit(spec)) {
  if (stop_channel_ >= 0 && status_channel_ >= 0) {
    stop_sender_ = std::make_unique<RunSender>(line_.socket(), ChannelUrl(spec, stop_channel_));
  }
  for (const LiveField& field : line_.fields()) Ask(field.path);
}

void BusOperator::Ask(const std::string& field) { asked_.emplace(line_.Ask(field), field); }

void BusOperator::SendStop(bool stop, bool reset) {
  emergency_stop_t message{};
  message.run_id = line_.spec().run_id();
  message.stop = stop ? 1 : 0;
  message.reset = reset ? 1 : 0;
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  // What gets lost is sent again.
  stop_sender_->Send(line_.spec().graph().channel(stop_channel_).name(), bytes.data(),
                     bytes.size());
}

void BusOperator::Answered(const OperatorAct& act, int64_t tick, std::string reason) {
  const bool accepted = reason.empty();
  answers_.push_back({act.client, act.id, accepted, tick, std::move(reason)});
}

int64_t BusOperator::Pass(const OperatorAct& act) {
  switch (act.kind) {
    case OperatorAct::Kind::kPush:
      return line_.Push(act.name, act.force, act.point, act.duration);
    case OperatorAct::Kind::kSet:
      return line_.Set(act.name, act.value);
    case OperatorAct::Kind::kStep:
      return line_.Step(act.name);
    case OperatorAct::Kind::kWalk:
      return line_.Walk(act.velocity.x(), act.velocity.y(), act.velocity.z());
    case OperatorAct::Kind::kStopWalking:
      return line_.Stand();
    default:
      throw ConfigError(fmt::format("{}: of an interactive run alone", ActName(act.kind)));
  }
}

void BusOperator::Do(const OperatorAct& act) {
  const bool stop = act.kind == OperatorAct::Kind::kStop;
  if (stop || act.kind == OperatorAct::Kind::kReset) {
    if (!stop_sender_) return Answered(act, -1, "this graph has no bridge that could stop");
    if (!stop && pending_ && pending_->act.kind == OperatorAct::Kind::kStop) {
      return Answered(act, -1, "a stop is under way");
    }
    if (pending_) Answered(pending_->act, -1, "another stop or reset has followed");
    pending_ = {act, Clock::now(), status_ ? status_->resets : 0};
    sent_ = {};
    return UpdateStop();
  }
  const std::string beyond = BeyondPage(act, push_limit_);
  if (!beyond.empty()) return Answered(act, -1, beyond);
  if (waiting_.size() >= kMostWaiting) return Answered(act, -1, "too many acts wait already");
  try {
    waiting_.emplace(Pass(act), act);
  } catch (const ConfigError& error) {
    Answered(act, -1, error.what());
  }
}

void BusOperator::Hear(const LiveMessage& message) {
  const auto size = static_cast<int64_t>(message.data.size());
  if (message.index >= 0 && message.index == answer_channel_) {
    operate::answer_t answer;
    if (DecodeChecked(message.data.data(), size, &answer) &&
        answer.kind == operate::act_t::KIND_SETTING) {
      ask_at_ = Clock::now() + kSettled;  // perhaps of poise set
    }
  }
  if (message.index < 0 || message.index != status_channel_) return;
  bridge_status_t status;
  if (!DecodeChecked(message.data.data(), size, &status)) return;
  status_ = status;
  if (!pending_) return;
  const bool stops = status.state >= bridge_status_t::STATE_STOPPING;
  const bool done =
      pending_->act.kind == OperatorAct::Kind::kStop ? stops : status.resets > pending_->resets;
  if (!done) return;
  Answered(pending_->act, status.tick, {});
  pending_.reset();
}

void BusOperator::UpdateStop() {
  if (!pending_) return;
  const auto now = Clock::now();
  const auto passed = now - pending_->start;
  const bool stop = pending_->act.kind == OperatorAct::Kind::kStop;
  if (passed > kStopPatience) {
    Answered(pending_->act, -1,
             stop ? "the bridge has not confirmed it for 3 s"
                  : "the bridge keeps its stop: its motors must be at rest, no torque commanded");
    pending_.reset();
  } else if (now > sent_ + kStopRepeat) {
    sent_ = now;
    SendStop(stop, !stop && passed > kResetLow);
  }
}

/// A value within a ramp is none that is in force.
void BusOperator::Heard(const std::string& field, double value) {
  const auto before = in_force_.find(field), last = heard_.find(field);
  if (before == in_force_.end() || (last != heard_.end() && last->second == value)) {
    in_force_[field] = value;
    heard_.erase(field);
  } else if (before->second != value) {
    heard_[field] = value;
    ask_at_ = Clock::now() + kSettled;
  } else {
    heard_.erase(field);
  }
}

void BusOperator::Update() {
  UpdateStop();
  line_.Update(0);
  if (ask_at_ && Clock::now() > *ask_at_ && asked_.empty()) {
    ask_at_.reset();
    for (const LiveField& field : line_.fields()) Ask(field.path);
  }
  for (auto it = asked_.begin(); it != asked_.end();) {
    const std::optional<ActOutcome> outcome = line_.TakeOutcome(it->first);
    if (outcome && outcome->done) Heard(it->second, outcome->value);
    // Who says nothing while the run begins is asked again.
    if (outcome && outcome->verdict == 0) ask_at_ = Clock::now() + kSettled;
    it = outcome ? asked_.erase(it) : std::next(it);
  }
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const std::optional<ActOutcome> outcome = line_.TakeOutcome(it->first);
    if (!outcome) {
      ++it;
      continue;
    }
    const OperatorAct& act = it->second;
    if (outcome->done && act.kind == OperatorAct::Kind::kSet) in_force_[act.name] = outcome->value;
    if (outcome->done && act.kind == OperatorAct::Kind::kPush) {
      push_ = act;
      push_until_ = outcome->tick + std::llround(act.duration / line_.spec().tick_period());
    }
    Answered(act, outcome->tick,
             outcome->done           ? ""
             : outcome->text.empty() ? "refused"
                                     : outcome->text);
    it = waiting_.erase(it);
  }
}

std::vector<OperatorSink::Answer> BusOperator::TakeAnswers() { return std::exchange(answers_, {}); }

nlohmann::ordered_json BusOperator::Standing() const {
  nlohmann::ordered_json json = StandingOf(line_.fields(), in_force_, push_limit_);
  json["can"] = {"push", "set", "step", "walk", "stop_walking"};
  if (stop_sender_) {
    json["can"].push_back("stop");
    json["can"].push_back("reset");
  }
  json["stopped"] = status_ && status_->state >= bridge_status_t::STATE_STOPPING;
  if (line_.tick() < push_until_) {
    json["push"] = {{"body", push_.name},
                    {"force", {push_.force.x(), push_.force.y(), push_.force.z()}}};
  }
  return json;
}

}  // namespace poise
