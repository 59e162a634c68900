#include "deploy/poise/kill_schedule.h"

#include <algorithm>
#include <csignal>

#include "components/framework/clock.h"
#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "poise/bridge_status_t.hpp"
#include "poise/message_traits.hpp"

namespace poise {
namespace {

constexpr int64_t kMillisecond = 1'000'000;  // ns
constexpr int64_t kStop = 100 * kMillisecond;
constexpr int kFreshCycles = 20;
constexpr double kShortestSlot = 0.5;  // s

int StatusChannel(const Graph& graph) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == "bridge_status_t") return i;
  }
  throw ConfigError(fmt::format(
      "graph {}: --kill needs a channel of bridge_status_t, to see when control is regained",
      graph.name()));
}

PacketFilter StatusFilter(const RunSpec& spec) {
  const Channel& channel = spec.graph().channel(StatusChannel(spec.graph()));
  const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
  bridge_status_t message{};
  MessageTraits<bridge_status_t>::Resize(message, counts);
  return {bridge_status_t::getHash(), message.getEncodedSize(), counts, spec.run_id()};
}

}  // namespace

void KillSchedule::Check(const RunSpec& spec, int count) {
  StatusChannel(spec.graph());
  const auto& instances = spec.graph().component();
  if (std::none_of(instances.begin(), instances.end(),
                   [](const ComponentInstance& c) { return c.restart(); })) {
    throw ConfigError(
        fmt::format("graph {}: --kill needs components with restart: true", spec.graph().name()));
  }
  const double slot = static_cast<double>(spec.num_ticks()) * spec.tick_period() / count;
  if (slot < kShortestSlot) {
    throw ConfigError(
        fmt::format("--kill {}: {:.1f} s are too short for so many; 0.5 s each at least, or a "
                    "longer --duration",
                    count, slot * count));
  }
}

KillSchedule::KillSchedule(const RunSpec& spec, int count, uint64_t seed)
    : slot_(static_cast<double>(spec.num_ticks()) * spec.tick_period() * 1e9 / std::max(1, count)),
      count_(count),
      random_(seed),
      filter_(StatusFilter(spec)),
      channel_(spec.graph().channel(StatusChannel(spec.graph())).name()),
      receiver_(ChannelUrl(spec, StatusChannel(spec.graph()))) {
  Check(spec, count);
  next_ = static_cast<int64_t>(std::uniform_real_distribution(0.02, 0.5)(random_) * slot_);
}

void KillSchedule::Act(int64_t now, int64_t elapsed,
                       const std::vector<std::unique_ptr<ComponentProcess>>& processes) {
  if (stopped_ != nullptr && now >= continue_at_) Finish();
  const auto done = static_cast<int>(faults_.size());
  if (done >= count_ || elapsed < next_) return;
  std::vector<ComponentProcess*> targets;
  for (const auto& process : processes) {
    if (process->restarts() && !process->process().ended()) targets.push_back(process.get());
  }
  if (targets.empty()) return;
  ComponentProcess& target = *targets[random_() % targets.size()];
  InjectedFault fault;
  fault.component = target.name();
  fault.killed = random_() % 2 == 0;
  fault.time = static_cast<double>(elapsed) * 1e-9;
  target.process().Signal(fault.killed ? SIGKILL : SIGSTOP);
  if (!fault.killed) {
    stopped_ = &target;
    continue_at_ = now + kStop;
  }
  faults_.push_back(fault);
  fault_at_ = now;
  regained_at_ = 0;
  fresh_in_a_row_ = 0;
  next_ =
      static_cast<int64_t>((done + 1 + std::uniform_real_distribution(0.0, 0.5)(random_)) * slot_);
}

void KillSchedule::Finish() {
  if (stopped_ != nullptr) stopped_->process().Signal(SIGCONT);
  stopped_ = nullptr;
}

void KillSchedule::Receive() {
  BusReceiver::Packet packet;
  while (receiver_.Receive(&packet)) {
    if (packet.channel != channel_ ||
        filter_.Check(packet.data, packet.size, 0, INT64_MAX) != PacketVerdict::kAccepted) {
      continue;
    }
    bridge_status_t status;
    if (status.decode(packet.data, 0, static_cast<int>(packet.size)) !=
        static_cast<int>(packet.size)) {
      continue;
    }
    Judge(NowNanoseconds(), status.command_age);
  }
}

void KillSchedule::Judge(int64_t arrival, int32_t command_age) {
  if (fault_at_ == 0) return;
  InjectedFault& fault = faults_.back();
  fault.cycles = std::max(fault.cycles, command_age);
  if (command_age > 0) {
    fresh_in_a_row_ = 0;
    regained_at_ = 0;
    return;
  }
  if (fresh_in_a_row_++ == 0) regained_at_ = arrival;
  // A stopped process may have had work in hand that was just done: only what follows counts.
  if (stopped_ == nullptr && fresh_in_a_row_ >= kFreshCycles) {
    fault.regained = fault.cycles == 0 ? 0 : static_cast<double>(regained_at_ - fault_at_) * 1e-9;
    fault_at_ = 0;
  }
}

}  // namespace poise
