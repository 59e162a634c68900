#include "components/framework/runners/process_runner.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "components/framework/bus/process_bus.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "components/framework/runners/component_group.h"
#include "components/framework/runners/latency_histogram.h"
#include "components/framework/runners/state_store.h"
#include "components/framework/runners/timing.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kMillisecondNs = 1'000'000;
constexpr int64_t kHealthInterval = 100 * kMillisecondNs;
constexpr int64_t kAnnounceInterval = 50 * kMillisecondNs;  // before the start and after the end
constexpr int64_t kFirstRequest = 2 * kMillisecondNs;
constexpr int64_t kLastRequest = 50 * kMillisecondNs;
constexpr int kDrainBatch = 32;
constexpr int64_t kLongestOutage = 5000 * kMillisecondNs;  // between a process and its successor

using BoundStage = ProcessBus::BoundStage;

}  // namespace

class ProcessRunner::Impl {
 public:
  Impl(const RunSpec& spec, const std::string& process, const ComponentRegistry& registry,
       const ProcessRunnerOptions& options);

  bool Run();
  const std::string& error() const { return error_; }

 private:
  /// What a stage's wait or run came to.
  enum class Outcome { kDone, kOvertaken, kStopped, kEnded };

  bool Asked() const { return bus_.stopped() || (options_.stop != nullptr && *options_.stop != 0); }
  bool Stopped() const { return Asked() || !error_.empty(); }

  void CheckTiming(const RunSpec& spec, const std::string& process);
  bool IsSource(size_t component) const;
  void Open();
  void WaitForStart();
  bool TakeOver();
  /// Each true when the component has ended by itself.
  bool RunTicks();
  bool RunOwner();
  bool RunFollower();
  /// The inputs of tick_ are wanted from now on.
  void Want();
  Outcome RunTick();
  bool StageReady(const BoundStage& stage) const;
  Outcome WaitForInputs(const BoundStage& stage);
  bool ChooseTick();
  Outcome RunStage(const BoundStage& stage, const Tick& tick);
  /// Ends the run as failed for a component's own reason.
  Outcome FailStage(size_t component, const std::string& reason);
  /// Ends tick_. True when the component or the run has come to its end.
  bool EndTick();
  void WaitUntil(int64_t time);
  void KeepState();
  void ReportProgress();
  void End(size_t component, int8_t state, std::string_view detail);
  /// All components come to their end together.
  void EndAll();
  void StayUntilStop();
  void Close();
  void Fail(std::string message);

  void Poll(int64_t deadline, int batch);
  void PublishHealth(int64_t now);
  template <class Change>
  void EachHealth(const Change& change) {
    for (size_t i = 0; i < bus_.num_components(); ++i) change(bus_.health(i));
  }
  const std::string& NameOf(size_t component) { return group_.components()[component].name; }

  ProcessRunnerOptions options_;
  double period_;
  int64_t period_ns_;
  bool realtime_;
  int64_t lead_;  // ticks
  int64_t num_ticks_;
  int64_t run_id_;
  int num_components_;  // of the graph
  RealtimeOptions realtime_options_;
  ComponentGroup group_;
  Timing timing_;  // of all of the group
  std::optional<RunSocket> asked_;
  ProcessBus bus_;
  std::unique_ptr<StateStore> store_;
  bool can_be_taken_over_ = false;
  bool is_source_ = false;
  std::vector<int> reporters_;  // those of the group that report their progress

  int64_t tick_ = 0;     // the one that runs
  int64_t arrival_ = 0;  // ns, of the last packets
  bool polled_ = false;  // in this tick
  int64_t next_health_ = 0;
  double lateness_ = 0;                    // s, of this cycle
  int64_t progress_ = 0;                   // ns, end of the last tick
  bool any_tick_ = false;                  // taken over without a state: the first tick may be any
  std::vector<LatencyHistogram> latency_;  // by component
  std::string error_;
};

ProcessRunner::Impl::Impl(const RunSpec& spec, const std::string& process,
                          const ComponentRegistry& registry, const ProcessRunnerOptions& options)
    : options_(options),
      period_(spec.tick_period()),
      period_ns_(static_cast<int64_t>(spec.tick_period() * 1e9)),
      realtime_(spec.realtime()),
      lead_(spec.lead_ticks()),
      num_ticks_(spec.num_ticks()),
      run_id_(spec.run_id()),
      num_components_(spec.graph().component_size()),
      realtime_options_(spec.realtime_options()),
      group_(spec, process, registry),
      timing_(TimingOf(spec, group_.components().front().index)),
      bus_(spec, options.socket != nullptr ? *options.socket : asked_.emplace(RunSocket::Ask(spec)),
           process, &group_.components(), JoinOf(timing_), options.take_over == nullptr),
      latency_(group_.components().size()) {
  CheckTiming(spec, process);
  if (!options_.state_path.empty()) {
    store_ = std::make_unique<StateStore>(options_.state_path);
    StateArchive measure;
    can_be_taken_over_ = group_.Archive(&measure);
    if (measure.size() > StateStore::kCapacity) {
      throw ConfigError(
          fmt::format("process {}: its state of {} bytes is more than the {} that are kept",
                      process, measure.size(), StateStore::kCapacity));
    }
  }
}

/// Whether its components can keep step, and whom its tick sources wait for.
void ProcessRunner::Impl::CheckTiming(const RunSpec& spec, const std::string& process) {
  const Graph& graph = spec.graph();
  for (size_t i = 0; i < group_.components().size(); ++i) {
    const int index = group_.components()[i].index;
    const bool source = IsSource(i);
    is_source_ = is_source_ || source;
    if (timing_ == Timing::kFollower && source) {
      throw ConfigError(fmt::format(
          "graph {}: component {} waits for no message of its tick; in real time it must own the "
          "clock (owns_clock) or stand for the robot (plant)",
          graph.name(), NameOf(i)));
    }
    // The wall clock waits for nobody: in real time the recorder and others must keep up.
    if (timing_ != Timing::kLockstep) continue;
    if (MustReportProgress(graph, index)) reporters_.push_back(index);
    if (!source) continue;
    for (const int reporter : ProgressReporters(graph, index)) {
      if (!group_.Has(reporter)) bus_.WaitFor(reporter);
    }
  }
  if (timing_ == Timing::kLockstep && is_source_ &&
      (options_.wait_for_recorder || spec.recorded())) {
    bus_.WaitFor(-1);
  }
  if (timing_ == Timing::kFollower && bus_.has_local_delay()) {
    throw ConfigError(fmt::format(
        "graph {}: in process {} one component reads another's message of the tick before, which "
        "may have been skipped in real time; run them in processes of their own",
        graph.name(), process));
  }
}

/// True when a component's first stage waits for no message of its tick.
bool ProcessRunner::Impl::IsSource(size_t component) const {
  const auto first = std::ranges::find(bus_.stages(), component, &BoundStage::component);
  const std::vector<InputPort*>& inputs = first->stage->inputs;
  return std::ranges::none_of(
      inputs, [](const InputPort* input) { return input->kind() == InputKind::kSameTick; });
}

bool ProcessRunner::Impl::Run() {
  if (options_.take_over != nullptr) {
    if (!TakeOver()) return error_.empty();
  } else {
    Open();
    if (!Stopped()) WaitForStart();
  }
  // The simulated robot must not be late either, but stands below the controller.
  const int below = timing_ == Timing::kOwner ? 0
                    : timing_ == Timing::kPlant
                        ? num_components_ + 1
                        : num_components_ - group_.components().back().index;
  const int8_t granted = AskForRealtime(realtime_options_, timing_, below);
  EachHealth([&](health_t& health) { health.scheduling = granted; });
  if (progress_ == 0) progress_ = NowNanoseconds();
  const auto run = [&] {
    switch (timing_) {
      case Timing::kOwner:
        return RunOwner();
      case Timing::kFollower:
        return RunFollower();
      case Timing::kLockstep:
      case Timing::kPlant:
        break;
    }
    return RunTicks();
  };
  if (!Stopped() && run()) StayUntilStop();
  Close();
  return error_.empty();
}

void ProcessRunner::Impl::Fail(std::string message) {
  if (error_.empty()) error_ = std::move(message);
}

void ProcessRunner::Impl::Open() {
  try {
    group_.Open();
    bus_.AttachDevices(group_.devices(), period_ns_);
  } catch (const std::exception& error) {
    Fail(error.what());
    End(std::min(group_.opened(), latency_.size() - 1), health_t::STATE_FAILED, error_);
    PublishHealth(NowNanoseconds());
  }
}

void ProcessRunner::Impl::WaitForStart() {
  EachHealth([](health_t& health) {
    health.state = health_t::STATE_READY;
    health.tick = -1;
  });
  int64_t next_idle = NowNanoseconds();
  while (!bus_.started() && !Stopped()) {
    Poll(next_idle, kDrainBatch);
    if (NowNanoseconds() < next_idle) continue;
    group_.Idle();
    next_idle += period_ns_;
  }
  EachHealth([](health_t& health) { health.state = health_t::STATE_RUNNING; });
  next_health_ = 0;  // at once: the launcher waits for it
}

/// Waits to be needed, then takes the place of a process that died. False when it is not needed.
bool ProcessRunner::Impl::TakeOver() {
  store_->set_standby(getpid());
  while (*options_.take_over == 0) {
    if (Stopped()) return false;
    bus_.Poll(NowNanoseconds() + kAnnounceInterval, kDrainBatch);
  }
  if (store_->tick() >= 0 && can_be_taken_over_) {
    StateArchive restore = StateArchive::Restoring(store_->latest());
    group_.Archive(&restore);
    if (!restore.ok()) {
      Fail("the stored state does not fit the components");
      return false;
    }
    tick_ = store_->tick() + 1;
    EachHealth([&](health_t& health) { health.tick = store_->tick(); });
    progress_ = NowNanoseconds() - kLongestOutage;
  } else {
    any_tick_ = true;
  }
  store_->CountRestart();
  try {
    bus_.OpenInputs();
  } catch (const std::exception& error) {
    Fail(error.what());
    return false;
  }
  EachHealth([](health_t& health) { health.state = health_t::STATE_RUNNING; });
  next_health_ = 0;
  return true;
}

void ProcessRunner::Impl::Want() {
  bus_.set_tick(tick_);
  for (const auto& inbox : bus_.inboxes()) {
    if (inbox->port().kind() == InputKind::kSameTick) inbox->Want(tick_);
    if (inbox->port().kind() == InputKind::kPreviousTick) {
      inbox->Want(std::max<int64_t>(0, tick_ - 1));
    }
  }
}

bool ProcessRunner::Impl::RunTicks() {
  const int64_t start = NowNanoseconds();
  const bool paced = realtime_ && timing_ == Timing::kLockstep;
  while (true) {
    polled_ = false;
    bus_.set_tick(tick_);
    if (is_source_) {
      while (!bus_.NearEnough(tick_) && !Stopped()) {
        Poll(NowNanoseconds() + kAnnounceInterval, kDrainBatch);
      }
      if (paced)
        WaitUntil(start + static_cast<int64_t>(static_cast<double>(tick_) * period_ * 1e9));
    }
    Want();
    const Outcome outcome = RunTick();
    if (outcome != Outcome::kDone) return outcome == Outcome::kEnded;
    if (!polled_) Poll(0, kDrainBatch);
    if (EndTick()) return true;
    if (Stopped()) return false;
  }
}

ProcessRunner::Impl::Outcome ProcessRunner::Impl::RunTick() {
  Tick tick = MakeTick(tick_, period_, lead_);
  tick.lateness = lateness_;
  for (const BoundStage& stage : bus_.stages()) {
    const Outcome waited = WaitForInputs(stage);
    if (waited != Outcome::kDone) return waited;
    const Outcome ran = RunStage(stage, tick);
    if (ran != Outcome::kDone) return ran;
  }
  return Outcome::kDone;
}

bool ProcessRunner::Impl::RunFollower() {
  while (true) {
    if (!ChooseTick()) return false;
    Want();
    const Outcome outcome = RunTick();
    if (outcome == Outcome::kOvertaken) continue;
    if (outcome != Outcome::kDone) return outcome == Outcome::kEnded;
    if (EndTick()) return true;
    if (Stopped()) return false;
  }
}

/// The newest tick whose first inputs are there becomes tick_. False: stopped before one came.
bool ProcessRunner::Impl::ChooseTick() {
  const BoundStage& first = bus_.stages()[0];
  const int64_t expected = tick_;
  polled_ = false;
  while (true) {
    int64_t newest = INT64_MAX;
    for (const auto& input : first.inputs) {
      if (input.inbox->port().kind() == InputKind::kSameTick) {
        newest = std::min(newest, input.inbox->newest());
      }
    }
    const bool whole =
        newest >= tick_ &&
        std::all_of(first.inputs.begin(), first.inputs.end(), [&](const auto& input) {
          return input.inbox->port().kind() != InputKind::kSameTick || input.inbox->Has(newest);
        });
    if (whole && polled_) {
      EachHealth([&](health_t& health) { health.ticks_skipped += newest - expected; });
      tick_ = newest;
      return true;
    }
    if (Stopped()) return false;
    // Once at least: what waits in the socket may be newer.
    Poll(whole ? 0 : NowNanoseconds() + kAnnounceInterval, kDrainBatch);
  }
}

bool ProcessRunner::Impl::RunOwner() {
  // The clock starts with the robot, whose first message may have come before this process could
  // hear it.
  const BoundStage& first = bus_.stages()[0];
  Want();
  int64_t next_request = NowNanoseconds() + kAnnounceInterval;
  while (!StageReady(first)) {
    if (Stopped()) return false;
    Poll(next_request, kDrainBatch);
    if (NowNanoseconds() < next_request || StageReady(first)) continue;
    bus_.Ask(first, tick_);
    next_request = NowNanoseconds() + kAnnounceInterval;
  }
  int64_t time = NowNanoseconds();
  health_t& health = bus_.health(0);  // the owner is alone
  while (true) {
    WaitUntil(time);
    const int64_t start = NowNanoseconds();
    lateness_ = static_cast<double>(std::max<int64_t>(0, start - time)) * 1e-9;
    health.lateness_max = std::max(health.lateness_max, lateness_ * 1e6);
    Want();
    Tick tick = MakeTick(tick_, period_, lead_);
    tick.lateness = lateness_;
    for (const BoundStage& stage : bus_.stages()) {
      const int64_t deadline =
          time + static_cast<int64_t>(stage.stage->deadline * static_cast<double>(period_ns_));
      while (!StageReady(stage) && !Stopped() && NowNanoseconds() < deadline) Poll(deadline, 1);
      if (Stopped()) return false;
      for (const BoundStage::BoundInput& input : stage.inputs) {
        if (input.inbox->port().kind() == InputKind::kSameTick) input.inbox->TakeLate();
      }
      const Outcome ran = RunStage(stage, tick);
      if (ran != Outcome::kDone) return true;
    }
    const int64_t end = NowNanoseconds();
    latency_[0].Add(end - start);
    if (end > time + period_ns_) ++health.deadline_misses;
    if (EndTick()) return true;
    if (Stopped()) return false;
    time += period_ns_ + group_.cycle_correction();
    // Whole cycles that are lost stay lost: a burst of them would not help the robot.
    const int64_t behind = NowNanoseconds() - time;
    if (behind >= period_ns_) {
      health.ticks_skipped += behind / period_ns_;
      time += behind / period_ns_ * period_ns_;
    }
  }
}

void ProcessRunner::Impl::WaitUntil(int64_t time) {
  // Packets are handled until shortly before; the rest is slept through, for an absolute deadline.
  while (!Stopped() && NowNanoseconds() < time - kMillisecondNs / 5) {
    Poll(time - kMillisecondNs / 5, kDrainBatch);
  }
  const timespec deadline{time / 1'000'000'000, time % 1'000'000'000};
  while (!Stopped() && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) != 0) {
  }
}

bool ProcessRunner::Impl::StageReady(const BoundStage& stage) const {
  return std::all_of(
      stage.inputs.begin(), stage.inputs.end(), [&](const BoundStage::BoundInput& input) {
        return input.inbox->ready() ||
               (tick_ == 0 && input.inbox->port().kind() == InputKind::kPreviousTick);
      });
}

ProcessRunner::Impl::Outcome ProcessRunner::Impl::WaitForInputs(const BoundStage& stage) {
  arrival_ = NowNanoseconds();
  const bool follower = timing_ == Timing::kFollower;
  int64_t wait = kFirstRequest + (realtime_ ? period_ns_ : 0);
  int64_t next_request = arrival_ + wait;
  while (!StageReady(stage)) {
    if (Stopped()) return Outcome::kStopped;
    Poll(next_request, 1);
    if (follower) {
      // Messages of a channel come in order: what is overtaken will not come.
      const bool overtaken =
          std::any_of(stage.inputs.begin(), stage.inputs.end(), [&](const auto& input) {
            return !input.inbox->ready() && input.inbox->newest() > tick_;
          });
      if (overtaken) return Outcome::kOvertaken;
      next_request = NowNanoseconds() + kAnnounceInterval;
      continue;
    }
    if (arrival_ < next_request || StageReady(stage)) continue;
    bus_.Ask(stage, tick_);
    // Doubled, the waits of many stages added up where half of the messages is lost.
    wait = std::min(wait + kFirstRequest, kLastRequest);
    next_request = arrival_ + wait;
  }
  return Outcome::kDone;
}

ProcessRunner::Impl::Outcome ProcessRunner::Impl::RunStage(const BoundStage& bound,
                                                           const Tick& tick) {
  for (const BoundStage::BoundInput& input : bound.inputs) {
    input.inbox->Show(tick.index == 0 && input.inbox->port().kind() == InputKind::kPreviousTick);
  }
  for (const BoundStage::LocalInput& input : bound.locals) {
    const bool absent = tick.index == 0 && input.port->kind() == InputKind::kPreviousTick;
    input.port->Bind(absent ? nullptr : input.message);
  }
  for (Outbox* outbox : bound.outputs) outbox->port().Stamp(run_id_, tick.index, tick.utime);
  bound.stage->run(tick);
  for (const BoundStage::BoundInput& input : bound.inputs) input.inbox->Hide();
  for (const BoundStage::LocalInput& input : bound.locals) input.port->Bind(nullptr);
  for (Outbox* outbox : bound.outputs) {
    if (outbox->port().TakeWithheld() && timing_ == Timing::kOwner) continue;
    if (!outbox->port().Finite()) {
      return FailStage(bound.component, fmt::format("output {} is not finite at tick {}",
                                                    outbox->port().name(), tick.index));
    }
    bus_.Send(outbox, tick.index);
  }
  // The owner's latency is that of the whole cycle.
  if (timing_ != Timing::kOwner) latency_[bound.component].Add(NowNanoseconds() - arrival_);
  return Outcome::kDone;
}

ProcessRunner::Impl::Outcome ProcessRunner::Impl::FailStage(size_t component,
                                                            const std::string& reason) {
  Fail(latency_.size() == 1 ? reason : fmt::format("{}: {}", NameOf(component), reason));
  End(component, health_t::STATE_FAILED, reason);
  return Outcome::kEnded;
}

bool ProcessRunner::Impl::EndTick() {
  const Tick tick = MakeTick(tick_, period_, lead_);
  // The state is kept at once after the command has left: a death in between loses it.
  if (store_ != nullptr && can_be_taken_over_) KeepState();
  bus_.SendRest();
  bus_.SendAnswers();
  bus_.KeepDelayed();
  EachHealth([&](health_t& health) {
    health.tick = tick.index;
    health.utime = tick.utime;
  });
  progress_ = NowNanoseconds();
  any_tick_ = false;
  ++tick_;
  if (tick_ % kProgressInterval == 0) ReportProgress();
  if (group_.finished() != nullptr || (num_ticks_ > 0 && tick_ >= num_ticks_)) {
    EndAll();
    return true;
  }
  return false;
}

void ProcessRunner::Impl::KeepState() {
  StateArchive save = StateArchive::Saving(store_->Next());
  group_.Archive(&save);
  if (save.ok()) store_->Commit(tick_, save.size());
}

void ProcessRunner::Impl::ReportProgress() {
  for (const int index : reporters_) {
    bus_.SendControl(run_control_t::COMMAND_RECORDED, tick_ - 1, index);
  }
}

void ProcessRunner::Impl::End(size_t component, int8_t state, std::string_view detail) {
  bus_.health(component).state = state;
  bus_.SetDetail(component, detail);
  next_health_ = 0;
}

void ProcessRunner::Impl::EndAll() {
  for (size_t i = 0; i < bus_.num_components(); ++i) {
    const Component& component = *group_.components()[i].component;
    const std::string_view finished = component.finished();
    const bool failed = !finished.empty() && component.failed();
    End(i, failed ? health_t::STATE_FAILED : health_t::STATE_FINISHED, finished);
  }
}

void ProcessRunner::Impl::StayUntilStop() {
  int64_t next_idle = NowNanoseconds();
  while (!Asked()) {
    Poll(next_idle, kDrainBatch);
    if (NowNanoseconds() < next_idle) continue;
    group_.Idle();
    next_idle += period_ns_;
  }
}

void ProcessRunner::Impl::Close() {
  const std::string problem = group_.Close();
  if (!problem.empty()) Fail(problem);
}

void ProcessRunner::Impl::Poll(int64_t deadline, int batch) {
  polled_ = true;
  bus_.SendRest();
  bus_.SendAnswers();
  const int64_t now = NowNanoseconds();
  if (now >= next_health_) PublishHealth(now);
  if (timing_ == Timing::kFollower) {
    // The clock's owner can have come as far ahead as this.
    const int64_t horizon = tick_ + kReceiveWindow - 1 + (now - progress_) / period_ns_;
    for (const auto& inbox : bus_.inboxes()) inbox->set_horizon(any_tick_ ? INT64_MAX : horizon);
  }
  arrival_ = bus_.Poll(std::min(deadline, next_health_), batch);
  if (bus_.broken()) Fail("the bus does not send any more; is the network up? run: poise doctor");
}

void ProcessRunner::Impl::PublishHealth(int64_t now) {
  bool running = false;
  for (size_t i = 0; i < latency_.size(); ++i) {
    health_t& health = bus_.health(i);
    running = running || health.state == health_t::STATE_RUNNING;
    health.ticks_completed = tick_;
    health.latency_median = latency_[i].median();
    health.latency_p99 = latency_[i].p99();
    health.latency_max = latency_[i].max();
    std::ranges::copy(latency_[i].HalfOctaves(), health.latency_count);
    health.restarts = store_ == nullptr ? 0 : store_->restarts();
  }
  next_health_ = now + (running ? kHealthInterval : kAnnounceInterval);
  bus_.SendHealth();
  // Also covers a report that was lost.
  if (tick_ > 0) ReportProgress();
}

ProcessRunner::ProcessRunner(const RunSpec& spec, const std::string& process,
                             const ComponentRegistry& registry, const ProcessRunnerOptions& options)
    : impl_(std::make_unique<Impl>(spec, process, registry, options)) {}
ProcessRunner::~ProcessRunner() = default;
bool ProcessRunner::Run() { return impl_->Run(); }
const std::string& ProcessRunner::error() const { return impl_->error(); }

}  // namespace poise
