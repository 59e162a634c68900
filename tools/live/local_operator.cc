#include "tools/live/local_operator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/events/operator_words.h"
#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"
#include "tools/live/bus_operator.h"

namespace poise {
namespace {

constexpr size_t kMostStops = 32;          // that wait, as while the run is paused
constexpr size_t kMostInjected = 200'000;  // acts of a run; an hour of dragging has 108,000

int IndexOf(const std::vector<std::string>& names, const std::string& name, const char* what) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) {
    throw ConfigError(fmt::format("no {} '{}'; there are {}", what, name, fmt::join(names, ", ")));
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace

LocalOperator::LocalOperator(const RunSpec& spec, Pace pace)
    : spec_(spec),
      pace_(std::move(pace)),
      fields_(LiveFields(spec)),
      targets_(FindActTargets(spec)),
      push_limit_(PagePushLimit(spec)) {
  const Graph& graph = spec_.graph();
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == kActType) act_channel_ = graph.channel(i).name();
    if (graph.channel(i).type() == kAnswerType) answer_channel_ = i;
    if (graph.channel(i).type() == "emergency_stop_t") stop_channel_ = graph.channel(i).name();
    if (graph.channel(i).type() == "bridge_status_t") status_channel_ = i;
  }
  if (act_channel_.empty() || answer_channel_ < 0) {
    throw ConfigError(
        fmt::format("graph {}: has no channels of type {} and {}; its runs take no "
                    "acts of an operator",
                    graph.name(), kActType, kAnswerType));
  }
}

void LocalOperator::Answered(const OperatorAct& act, int64_t tick, std::string reason) {
  const bool accepted = reason.empty();
  answers_.push_back({act.client, act.id, accepted, tick, std::move(reason)});
}

template <class Message>
bool LocalOperator::Inject(const std::string& channel, const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  if (done_.size() >= kMostInjected || !runner_->Inject(channel, bytes)) return false;
  done_.push_back({runner_->ticks_completed(), channel, std::move(bytes)});
  next_repeat_ = done_.size();
  return true;
}

void LocalOperator::Fill(const OperatorAct& act, operate::act_t* message) const {
  message->component = targets_.planner;
  switch (act.kind) {
    case OperatorAct::Kind::kPush:
      message->kind = operate::act_t::KIND_PUSH;
      message->component = targets_.simulator;
      message->body = act.name.empty() ? 0 : IndexOf(targets_.bodies, act.name, "body");
      for (int i = 0; i < 3; ++i) {
        message->force[i] = act.force[i];
        message->point[i] = act.point[i];
      }
      message->duration = std::max<int64_t>(1, std::llround(act.duration / spec_.tick_period()));
      break;
    case OperatorAct::Kind::kSet: {
      const auto field = std::ranges::find(fields_, act.name, &LiveField::path);
      if (field == fields_.end()) {
        throw ConfigError(fmt::format("{}: is no setting of this run", act.name));
      }
      message->kind = operate::act_t::KIND_SETTING;
      message->component = field->component;
      const std::string name = act.name.substr(act.name.find('.') + 1);
      std::copy(name.begin(), name.end(), message->field);  // LiveSettings::Add checked its length
      message->value = act.value;
      break;
    }
    case OperatorAct::Kind::kStep:
      message->kind = operate::act_t::KIND_STEP;
      message->foot =
          static_cast<int8_t>(act.name.empty() ? -1 : IndexOf(targets_.feet, act.name, "foot"));
      break;
    case OperatorAct::Kind::kWalk:
      message->kind = operate::act_t::KIND_WALK;
      for (int i = 0; i < 3; ++i) message->velocity[i] = act.velocity[i];
      break;
    case OperatorAct::Kind::kStopWalking:
      message->kind = operate::act_t::KIND_STAND;
      break;
    default:
      throw ConfigError(fmt::format("{}: go back instead", ActName(act.kind)));
  }
  if (message->component < 0) throw ConfigError("nothing in this graph takes it");
}

void LocalOperator::Do(const OperatorAct& act) {
  switch (act.kind) {
    case OperatorAct::Kind::kPause:
    case OperatorAct::Kind::kGo:
    case OperatorAct::Kind::kTick:
    case OperatorAct::Kind::kSpeed:
    case OperatorAct::Kind::kBack:
    case OperatorAct::Kind::kRestart:
      return Answered(act, -1, pace_(act));
    default:
      break;
  }
  if (runner_->ended()) return Answered(act, -1, "the run has ended; go back or start again");
  if (act.kind == OperatorAct::Kind::kStop) {
    emergency_stop_t message{};
    message.run_id = spec_.run_id();
    message.stop = 1;
    if (stop_channel_.empty() || status_channel_ < 0) {
      return Answered(act, -1, "this graph has no bridge that could stop");
    }
    if (stops_.size() >= kMostStops) return Answered(act, -1, "too many stops wait already");
    if (!Inject(stop_channel_, message)) return Answered(act, -1, "the run does not take it");
    stops_.push_back(act);  // the bridge's status answers it
    return;
  }
  const std::string beyond = BeyondPage(act, push_limit_);
  if (!beyond.empty()) return Answered(act, -1, beyond);
  operate::act_t message{};
  try {
    Fill(act, &message);
  } catch (const ConfigError& error) {
    return Answered(act, -1, error.what());
  }
  message.run_id = spec_.run_id();
  message.tick = runner_->ticks_completed();
  message.id = next_id_++;
  // Refusals come from within Inject.
  waiting_[message.id] = act;
  if (!Inject(act_channel_, message)) {
    waiting_.erase(message.id);
    Answered(act, -1, "the run does not take it");
  }
}

void LocalOperator::Hear(int channel, std::span<const uint8_t> data) {
  if (channel >= 0 && channel == status_channel_) return HearStatus(data);
  operate::answer_t answer;
  if (channel != answer_channel_ ||
      !DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &answer)) {
    return;
  }
  const auto found = waiting_.find(answer.id);
  if (found == waiting_.end()) return;  // repeated
  const OperatorAct act = found->second;
  waiting_.erase(found);
  const bool done = answer.verdict == operate::answer_t::VERDICT_DONE;
  if (done && act.kind == OperatorAct::Kind::kPush) {
    push_ = act;
    push_until_ = answer.tick + std::llround(act.duration / spec_.tick_period());
  }
  Answered(act, answer.tick, done ? "" : logging::RefusalReason(answer.kind, answer.verdict));
}

void LocalOperator::HearStatus(std::span<const uint8_t> data) {
  bridge_status_t status;
  if (!DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &status)) return;
  stopped_ = status.state >= bridge_status_t::STATE_STOPPING;
  if (stopped_) AnswerStops(status.tick, {});
}

void LocalOperator::AnswerStops(int64_t tick, const std::string& reason) {
  for (const OperatorAct& act : stops_) Answered(act, tick, reason);
  stops_.clear();
}

void LocalOperator::Repeat(int64_t tick) {
  for (; next_repeat_ < done_.size() && done_[next_repeat_].tick <= tick; ++next_repeat_) {
    const Injected& injected = done_[next_repeat_];
    runner_->Inject(injected.channel, injected.bytes);
  }
}

void LocalOperator::Forget(int64_t tick) {
  std::erase_if(done_, [&](const Injected& injected) { return injected.tick >= tick; });
  next_repeat_ = 0;
  for (const auto& [id, act] : waiting_) Answered(act, -1, "the run went back before its tick");
  waiting_.clear();
  AnswerStops(-1, "the run went back before its tick");
  push_until_ = -1;
  stopped_ = false;
}

std::vector<OperatorSink::Answer> LocalOperator::TakeAnswers() {
  if (runner_->ended()) AnswerStops(-1, "the run ended before the bridge told of it");
  return std::exchange(answers_, {});
}

nlohmann::ordered_json LocalOperator::Standing() const {
  std::map<std::string, double> in_force;
  for (const LiveField& field : fields_) {
    const auto& component = *runner_->graph().component(field.component).component;
    const auto* const operated = dynamic_cast<const Operated*>(&component);
    if (operated == nullptr) continue;
    const std::string name = field.path.substr(field.path.find('.') + 1);
    for (const LiveSetting& setting : operated->live_settings().all()) {
      if (setting.field == name) {
        in_force[field.path] = setting.ticks > 0 ? setting.to : *setting.value;
      }
    }
  }
  nlohmann::ordered_json json = StandingOf(fields_, in_force, push_limit_);
  json["can"] = {"push",  "set", "step", "walk",  "stop_walking", "stop",
                 "pause", "go",  "tick", "speed", "back",         "restart"};
  json["stopped"] = stopped_;
  if (runner_->ticks_completed() < push_until_) {
    json["push"] = {{"body", push_.name},
                    {"force", {push_.force.x(), push_.force.y(), push_.force.z()}}};
  }
  return json;
}

}  // namespace poise
