#include "tools/operator/bus_port.h"

#include <poll.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/graph.h"
#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kMillisecondNs = 1'000'000;
constexpr int64_t kRepeatAct = 20 * kMillisecondNs;
constexpr int64_t kPatience = 3000 * kMillisecondNs;
constexpr int64_t kResetLow = 200 * kMillisecondNs;  // before the edge of a reset
constexpr int64_t kSettled = 1000 * kMillisecondNs;  // longer than a setting's ramp
constexpr int kMostTries = 8;                        // each twice as far ahead as the one before
// s of wall time that an act is sent ahead of its tick, and ticks at least: what a busy machine
// takes to hand it on. An act that is late all the same goes again, farther ahead.
constexpr double kAhead = 0.03;
constexpr int64_t kLeastAhead = 5;
constexpr int64_t kOwn = -1;  // the client of the port's own questions

bool IsOwn(const OperatorAct& act) { return act.client == kOwn; }
bool IsOfStop(const OperatorAct& act) { return MessageKind(act.kind) == 0; }

/// The run, if it can be heard from here. Throws ConfigError.
RunSpec Networked(RunSpec spec) {
  if (spec.first_port() != 0) return spec;
  throw ConfigError(
      fmt::format("run {}: runs inside one process, which hears nobody: use its page, if it is "
                  "interactive, end it with Ctrl-C, or start it without --inline",
                  spec.run_id()));
}

}  // namespace

BusPort::BusPort(RunSpec run) : ActPort(Networked(std::move(run))) {
  const Graph& graph = spec().graph();
  const Origin run_itself = OfRun(spec());
  if (answer_channel_ >= 0) {
    answers_line_ = std::make_unique<BusReceiver>(ChannelUrl(spec(), answer_channel_), run_itself);
  }
  tick_channel_ = status_channel_;
  for (int i = 0; tick_channel_ < 0 && i < graph.channel_size(); ++i) {
    if (!graph.channel(i).external()) tick_channel_ = i;
  }
  if (tick_channel_ < 0) throw ConfigError(fmt::format("graph {}: has no channel", graph.name()));
  const Channel& ticks = graph.channel(tick_channel_);
  const MessageType* const type = FindMessageType(ticks.type());
  if (type == nullptr) {
    throw ConfigError(
        fmt::format("channel {}: this program does not know {}", ticks.name(), ticks.type()));
  }
  tick_offset_ = type->run_id_offset;
  ticks_ = std::make_unique<BusReceiver>(ChannelUrl(spec(), tick_channel_), run_itself);
  std::random_device random;
  next_id_ = static_cast<int64_t>((uint64_t{random()} << 31) ^ random()) + 1;
}

void BusPort::Join() {
  if (!socket_) socket_.emplace(RunSocket::Ask(spec()));
}

void BusPort::FollowSettings() {
  fields();
  Join();
  follows_ = true;
  ask_at_ = NowNanoseconds();
}

void BusPort::Do(OperatorAct act) {
  if (act.kind != OperatorAct::Kind::kStop) Join();
  ActPort::Do(std::move(act));
}

std::vector<OperatorAct> BusPort::Wait(std::vector<OperatorAct> acts) {
  for (size_t i = 0; i < acts.size(); ++i) {
    acts[i].id = static_cast<int64_t>(i);
    Do(acts[i]);
  }
  for (size_t left = acts.size(); left > 0;) {
    Update(10);
    for (OperatorAct& act : TakeAnswers()) {
      acts[static_cast<size_t>(act.id)] = std::move(act);
      --left;
    }
  }
  return acts;
}

bool BusPort::Send(int channel, const std::vector<uint8_t>& bytes) {
  const std::string& name = spec().graph().channel(channel).name();
  const std::string url = ChannelUrl(spec(), channel);
  if (socket_) {
    return senders_.try_emplace(channel, *socket_, url)
        .first->second.Send(name, bytes.data(), bytes.size());
  }
  if (!stranger_) stranger_ = std::make_unique<BusSender>(url);
  return stranger_->Send(name.c_str(), bytes.data(), bytes.size());
}

void BusPort::Start(Waiting* waiting) {
  waiting->since = NowNanoseconds();
  if (IsOfStop(waiting->act)) Carry(waiting, waiting->since);
}

bool BusPort::Again(Waiting* waiting) {
  if (++waiting->tries >= kMostTries) return false;
  waiting->message.id = next_id_++;  // another act, since that one is refused for good
  waiting->sent = 0;
  return true;
}

void BusPort::Carry(Waiting* waiting, int64_t now) {
  if (IsOfStop(waiting->act)) {
    const bool stop = waiting->act.kind == OperatorAct::Kind::kStop;
    const bool edge = !stop && waiting->resets >= 0 && now > waiting->since + kResetLow;
    waiting->went = SendStop(stop, edge) || waiting->went;
  } else {
    if (tick_ < 0) return;
    if (waiting->sent == 0) {
      const double heard = static_cast<double>(tick_time_ - first_time_) * 1e-9;
      // The run goes on as fast as it has gone; at first as real time.
      const double rate = heard > 0.05 ? static_cast<double>(tick_ - first_tick_) / heard
                                       : 1 / spec().tick_period();
      const double since = static_cast<double>(now - tick_time_) * 1e-9;
      const auto ahead = static_cast<int64_t>(std::ldexp(kAhead + since, waiting->tries) * rate);
      waiting->message.tick = tick_ + kLeastAhead + ahead;
    }
    Send(waiting->message);
  }
  waiting->sent = now;
}

void BusPort::Hear() {
  BusReceiver::Packet packet;
  const int64_t now = NowNanoseconds();
  while (ticks_->Receive(&packet)) {
    const auto at = static_cast<size_t>(tick_offset_);
    if (packet.channel != spec().graph().channel(tick_channel_).name() || packet.size < at + 16 ||
        ReadInt64(packet.data + at) != spec().run_id()) {
      continue;
    }
    tick_ = std::max(tick_, ReadInt64(packet.data + at + 8));
    tick_time_ = now;
    if (first_tick_ < 0) {
      first_tick_ = tick_;
      first_time_ = now;
    }
    if (tick_channel_ == status_channel_) HearStatus({packet.data, packet.size});
  }
  while (answers_line_ && answers_line_->Receive(&packet)) {
    const bool set = HearAnswer({packet.data, packet.size}) == operate::act_t::KIND_SETTING;
    if (set && follows_) ask_at_ = now + kSettled;  // perhaps of poise set
  }
}

std::string BusPort::Silence(const Waiting& waiting) const {
  if (!IsOfStop(waiting.act)) {
    return tick_ < 0 ? "no tick of the run was heard for 3 s; has it ended, or not begun?"
                     : "nobody has answered for 3 s; has the run ended?";
  }
  if (!waiting.went) {
    return "the message could not be sent; is the network up? run: poise doctor";
  }
  if (waiting.act.kind == OperatorAct::Kind::kStop) {
    return "the stop was sent, but no bridge has confirmed it for 3 s; does the run's reference "
           "still go on?";
  }
  return resets_ < 0 ? "no bridge has answered; does the run's reference still go on?"
         : !stopped_ ? "there is no stop to reset"
                     : "the bridge keeps its stop; it resets only when its motors are at rest and "
                       "no torque is commanded";
}

void BusPort::Update(int timeout_ms) {
  pollfd fds[] = {{ticks_->fd(), POLLIN, 0}, {answers_line_ ? answers_line_->fd() : -1, POLLIN, 0}};
  // Ticks wake too often to be waited for once they are known.
  const bool waits = tick_ < 0;
  poll(waits ? fds : fds + 1, waits ? 2 : 1, timeout_ms);
  Hear();
  const int64_t now = NowNanoseconds();
  std::vector<std::pair<int64_t, std::string>> unanswered;
  for (Waiting& waiting : waiting_) {
    if (now > waiting.since + kPatience) {
      unanswered.emplace_back(waiting.message.id, Silence(waiting));
    } else if (waiting.sent == 0 || now > waiting.sent + kRepeatAct) {
      Carry(&waiting, now);
    }
  }
  for (auto& [id, why] : unanswered) Answer(id, -1, std::move(why));
  const auto is_own = [](const Waiting& waiting) { return IsOwn(waiting.act); };
  if (ask_at_ && now > *ask_at_ && std::ranges::none_of(waiting_, is_own)) {
    ask_at_.reset();
    for (const LiveField& field : fields()) {
      OperatorAct question;
      question.kind = OperatorAct::Kind::kAsk;
      question.client = kOwn;
      question.name = field.path;
      Do(std::move(question));
    }
  }
}

bool BusPort::Note(const OperatorAct& act) {
  const bool accepted = act.state == OperatorAct::State::kAccepted;
  if (!IsOwn(act)) {
    if (accepted && act.kind == OperatorAct::Kind::kSet) in_force_[act.name] = act.value;
    return true;
  }
  // Who says nothing while the run begins is asked again.
  if (act.tick < 0) ask_at_ = NowNanoseconds() + kSettled;
  if (!accepted) return false;
  const auto before = in_force_.find(act.name), last = heard_.find(act.name);
  if (before == in_force_.end() || (last != heard_.end() && last->second == act.value)) {
    in_force_[act.name] = act.value;
    heard_.erase(act.name);
  } else if (before->second != act.value) {
    heard_[act.name] = act.value;
    ask_at_ = NowNanoseconds() + kSettled;
  } else {
    heard_.erase(act.name);
  }
  return false;
}

}  // namespace poise
