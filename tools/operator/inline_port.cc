#include "tools/operator/inline_port.h"

#include <utility>

#include "components/framework/operator_acts.h"

namespace poise {
namespace {

constexpr size_t kMostInjected = 200'000;  // acts of a run; an hour of dragging has 108,000

}  // namespace

InlinePort::InlinePort(const RunSpec& spec, Pace pace) : ActPort(spec), pace_(std::move(pace)) {}

/// An act on the run itself, which no component receives.
bool InlinePort::Paces(OperatorAct::Kind kind) const {
  return pace_ && MessageKind(kind) == 0 && kind != OperatorAct::Kind::kStop;
}

std::string InlinePort::WhyNot(OperatorAct::Kind kind) const {
  if (kind == OperatorAct::Kind::kReset) return "go back instead";
  return Paces(kind) ? "" : ActPort::WhyNot(kind);
}

bool InlinePort::Send(int channel, const std::vector<uint8_t>& bytes) {
  if (done_.size() >= kMostInjected ||
      !runner_->Inject(spec().graph().channel(channel).name(), bytes)) {
    return false;
  }
  if (pace_) {
    done_.push_back({runner_->ticks_completed(), channel, bytes});
    next_repeat_ = done_.size();
  }
  return true;
}

void InlinePort::Start(Waiting* waiting) {
  const int64_t id = waiting->message.id;
  const OperatorAct::Kind kind = waiting->act.kind;
  if (Paces(kind)) return Answer(id, -1, pace_(waiting->act));
  if (runner_->ended()) {
    return Answer(id, -1,
                  pace_ ? "the run has ended; go back or start again" : "the run has ended");
  }
  waiting->message.tick = runner_->ticks_completed() + (runner_->begun() ? 1 : 0);
  // A refusal comes from within; the bridge's status answers a stop.
  const bool sent =
      kind == OperatorAct::Kind::kStop ? SendStop(true, false) : Send(waiting->message);
  if (!sent) Answer(id, -1, "the run does not take it");
}

void InlinePort::Hear(int channel, std::span<const uint8_t> data) {
  if (channel == answer_channel_) HearAnswer(data);
  if (channel == status_channel_) HearStatus(data);
}

void InlinePort::Repeat(int64_t tick) {
  for (; next_repeat_ < done_.size() && done_[next_repeat_].tick <= tick; ++next_repeat_) {
    const Injected& injected = done_[next_repeat_];
    runner_->Inject(spec().graph().channel(injected.channel).name(), injected.bytes);
  }
}

void InlinePort::Forget(int64_t tick) {
  std::erase_if(done_, [&](const Injected& injected) { return injected.tick >= tick; });
  next_repeat_ = 0;
  while (!waiting_.empty()) {
    Answer(waiting_.front().message.id, -1, "the run went back before its tick");
  }
  push_until_ = -1;
  stopped_ = false;
}

void InlinePort::Update(int) {
  if (!runner_->ended()) return;
  Refuse(OperatorAct::Kind::kStop, "the run ended before the bridge told of it");
}

std::map<std::string, double> InlinePort::InForce() const {
  std::map<std::string, double> in_force;
  for (const LiveField& field : fields()) {
    const Wiring& wiring = runner_->graph().component(field.component).wiring;
    const std::string name = field.path.substr(field.path.find('.') + 1);
    for (const LiveSetting& setting : LiveSettingsOf(wiring)) {
      if (setting.field == name) {
        in_force[field.path] = setting.ticks > 0 ? setting.to : *setting.value;
      }
    }
  }
  return in_force;
}

}  // namespace poise
