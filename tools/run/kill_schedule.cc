#include "tools/run/kill_schedule.h"

#include <algorithm>
#include <cmath>
#include <csignal>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kMillisecond = 1'000'000;  // ns
constexpr int64_t kStop = 100 * kMillisecond;
constexpr int kFreshCycles = 20;
constexpr double kShortestSlot = 0.5;  // s

int StatusChannel(const Graph& graph) {
  const int channel = FindChannelOfType(graph, "bridge_status_t");
  if (channel >= 0) return channel;
  throw ConfigError(fmt::format(
      "graph {}: --kill needs a channel of bridge_status_t, to see when control is regained",
      graph.name()));
}

double LeadOf(const RunSpec& spec) {
  return static_cast<double>(spec.lead_ticks()) * spec.tick_period();
}

/// s of the scenario's time in which faults are injected.
struct Window {
  double from, until;
};

Window WindowOf(const RunSpec& spec, const KillOptions& options) {
  const double lead = LeadOf(spec);
  const double end = static_cast<double>(spec.num_ticks()) * spec.tick_period() - lead;
  return {std::max(options.from, -lead), std::min(options.until.value_or(end), end)};
}

}  // namespace

void KillSchedule::Check(const RunSpec& spec, const KillOptions& options) {
  StatusChannel(spec.graph());
  const auto& instances = spec.graph().component();
  if (std::ranges::none_of(instances, [](const ComponentInstance& c) { return c.restart(); })) {
    throw ConfigError(
        fmt::format("graph {}: --kill needs components with restart: true", spec.graph().name()));
  }
  const Window window = WindowOf(spec, options);
  const double length = window.until - window.from;
  if (length / options.count < kShortestSlot) {
    throw ConfigError(fmt::format(
        "--kill {}: {:.1f} s are too short for so many; at most {:.0f}, one in {} s, or "
        "a longer --duration",
        options.count, std::max(0.0, length), std::floor(std::max(0.0, length) / kShortestSlot),
        kShortestSlot));
  }
}

KillSchedule::KillSchedule(const RunSpec& spec, const KillOptions& options)
    : count_(options.count), random_(options.seed), status_(spec, StatusChannel(spec.graph())) {
  Check(spec, options);
  const Window window = WindowOf(spec, options);
  first_ = (window.from + LeadOf(spec)) * 1e9;
  slot_ = (window.until - window.from) * 1e9 / count_;
  lead_ = LeadOf(spec);
  next_ = TimeOf(0, std::uniform_real_distribution(0.02, 0.5)(random_));
}

int64_t KillSchedule::TimeOf(int fault, double share) const {
  return static_cast<int64_t>(first_ + (fault + share) * slot_);
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
  fault.process = target.name();
  fault.killed = random_() % 2 == 0;
  fault.time = static_cast<double>(elapsed) * 1e-9 - lead_;
  target.process().Signal(fault.killed ? SIGKILL : SIGSTOP);
  if (!fault.killed) {
    stopped_ = &target;
    continue_at_ = now + kStop;
  }
  faults_.push_back(fault);
  fault_at_ = now;
  regained_at_ = 0;
  fresh_in_a_row_ = 0;
  lost_ = false;
  next_ = TimeOf(done + 1, std::uniform_real_distribution(0.0, 0.5)(random_));
}

void KillSchedule::Finish() {
  if (stopped_ != nullptr) stopped_->process().Signal(SIGCONT);
  stopped_ = nullptr;
}

void KillSchedule::Receive() {
  bridge_status_t status;
  while (status_.Next(&status)) Judge(NowNanoseconds(), status);
}

void KillSchedule::Judge(int64_t arrival, const bridge_status_t& status) {
  if (fault_at_ == 0) return;
  InjectedFault& fault = faults_.back();
  fault.cycles = std::max(fault.cycles, status.command_age);
  // Before the first command the bridge knows no age.
  if (status.state != bridge_status_t::STATE_RUNNING || status.command_age > 0) {
    lost_ = true;
    fresh_in_a_row_ = 0;
    regained_at_ = 0;
    return;
  }
  if (fresh_in_a_row_++ == 0) regained_at_ = arrival;
  // A stopped process may have had work in hand that was just done: only what follows counts.
  if (stopped_ == nullptr && fresh_in_a_row_ >= kFreshCycles) {
    fault.regained = !lost_ ? 0 : static_cast<double>(regained_at_ - fault_at_) * 1e-9;
    fault_at_ = 0;
  }
}

}  // namespace poise
