#include "tools/run/launcher.h"

#include <algorithm>
#include <csignal>
#include <fstream>

#include "components/framework/clock.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/framework/runners/component_main.h"
#include "components/framework/runners/timing.h"
#include "fmt/format.h"
#include "tools/cli/signals.h"
#include "tools/run/run_dir.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns
constexpr int64_t kStartTimeout = 30 * kSecond;
constexpr int64_t kRecordTimeout = 30 * kSecond;
constexpr int64_t kStopPatience = 2 * kSecond;  // before SIGTERM, and again before SIGKILL
constexpr int64_t kSettled = 10 * kSecond;      // memory is measured from here on
constexpr int64_t kSilence = 2 * kSecond;       // of a process that can be replaced
constexpr int64_t kQuiet = kSecond / 5;  // before it is looked at: it speaks ten times a second
constexpr int kSpin = 20;                // ms
constexpr size_t kDetailLines = 5;
constexpr std::string_view kWarning = "warning: ";  // begins a line that a user should see

}  // namespace

Launcher::Launcher(const RunSpec& spec, const RunSocket& socket, std::filesystem::path dir,
                   const LaunchOptions& options, Progress* progress)
    : spec_(spec),
      socket_(socket),
      dir_(std::move(dir)),
      progress_(progress),
      control_(spec, &socket,
               options.log ? std::vector<std::string>{kRecorderName} : std::vector<std::string>{}),
      log_(options.log) {
  if (options.kills.count > 0) kills_ = std::make_unique<KillSchedule>(spec, options.kills);
  if (spec.realtime()) crane_ = std::make_unique<CraneWatch>(spec);
}

Launcher::~Launcher() = default;

RunOutcome Launcher::Run() {
  StartProcesses();
  if (WaitUntilReady() && Start()) Watch();
  progress_->Clear();
  ReportProcesses();
  if (kills_ != nullptr) kills_->Finish();
  StopProcesses();
  if (kills_ != nullptr) outcome_.faults = kills_->faults();
  if (spec_.realtime()) outcome_.machine = machine_.Load();
  if (crane_ != nullptr) outcome_.crane_let_go = crane_->let_go();
  return outcome_;
}

void Launcher::StartProcesses() {
  const auto start = [&](const std::string& name, std::vector<std::string> command,
                         bool restart = false, std::vector<std::string> components = {}) {
    command[0] = FindProgram(command[0]).string();
    processes_.push_back(std::make_unique<ComponentProcess>(
        name, command, dir_ / (name + ".log"), restart, socket_, std::move(components)));
  };
  const std::string spec_file = dir_ / kSpecFile;
  if (log_) {
    start(kRecorderName, {"recorder", "--run", spec_file, "--scenario", dir_ / kScenarioFile,
                          "--log", dir_ / "run.lcm", "--report", dir_ / "recorder.json"});
  }
  // No process has a successor in lockstep, which would lack the messages of its tick; and the run
  // can be repeated.
  const Graph& graph = spec_.graph();
  for (const std::string& process : ProcessNames(graph)) {
    std::vector<std::string> names;
    for (const int i : ComponentsOf(graph, process)) names.push_back(graph.component(i).name());
    const ComponentInstance& first = graph.component(ComponentsOf(graph, process).front());
    const std::vector<std::string> command =
        names.size() == 1
            ? std::vector<std::string>{TypeOf(first), "--run", spec_file, "--component",
                                       first.name()}
            : std::vector<std::string>{kHostProgram, "--run", spec_file, "--process", process};
    start(process, command, spec_.realtime() && first.restart(), names);
  }
}

void Launcher::Fail(RunFault fault, std::string message, std::vector<std::string> details) {
  if (!outcome_.message.empty()) return;
  outcome_.fault = std::move(fault);
  outcome_.message = std::move(message);
  outcome_.details = std::move(details);
}

void Launcher::Fail(std::string message) {
  RunFault fault{RunFault::Kind::kStopped, "", message};
  Fail(std::move(fault), std::move(message));
}

void Launcher::FailProcess(ComponentProcess& component_process) {
  for (const std::string& name : component_process.components()) {
    const health_t& health = control_.statuses().at(name).health;
    if (health.state == health_t::STATE_FAILED && !health.detail.empty()) {
      Fail({RunFault::Kind::kStopped, name, health.detail},
           fmt::format("{}: {}", name, health.detail));
      return;
    }
  }
  ChildProcess& process = component_process.process();
  const int64_t tick = Tick();
  Fail({RunFault::Kind::kCrashed, process.name(), process.HowItEnded()},
       fmt::format("{} {}{}; its output: {}", process.name(), process.HowItEnded(),
                   tick < 0
                       ? " before the start"
                       : fmt::format(" at {:.3f} s",
                                     MakeTick(tick, spec_.tick_period(), spec_.lead_ticks()).time),
                   process.log_path()),
       LastLines(process.log_path(), kDetailLines));
}

std::vector<std::string> Launcher::WaitedFor(int64_t now) const {
  std::vector<std::string> silent, last;
  int64_t least = INT64_MAX;
  for (const auto& [name, status] : control_.statuses()) {
    // Who waits still says so, ten times a second.
    if (!status.seen || now - status.last_seen > kStallPatience / 2) silent.push_back(name);
    if (status.health.tick < least) last.clear();
    least = std::min(least, status.health.tick);
    if (status.health.tick == least) last.push_back(name);
  }
  return silent.empty() ? last : silent;
}

bool Launcher::Healthy() {
  if (StopSignal() != 0) {
    outcome_.interrupted = true;
    Fail(fmt::format("interrupted ({})", sigdescr_np(StopSignal())));
    return false;
  }
  // One that died first may have others follow: a non-zero end names the culprit best.
  const int64_t now = NowNanoseconds();
  ComponentProcess* dead = nullptr;
  outcome_.takeovers = 0;
  for (const auto& process : processes_) {
    if (!process->Alive(now) && (dead == nullptr || dead->process().succeeded())) {
      dead = process.get();
    }
    outcome_.takeovers += process->takeovers();
  }
  if (dead != nullptr) FailProcess(*dead);
  return dead == nullptr;
}

bool Launcher::RecorderFailed() {
  if (!log_) return false;
  const health_t& health = control_.statuses().at(kRecorderName).health;
  if (health.state != health_t::STATE_FAILED) return false;
  Fail({RunFault::Kind::kStopped, kRecorderName, health.detail},
       fmt::format("the recorder cannot go on: {}", health.detail));
  return true;
}

int64_t Launcher::Tick() const {
  int64_t tick = -1;
  for (const ComponentInstance& instance : spec_.graph().component()) {
    const ControlClient::Status& status = control_.statuses().at(instance.name());
    if (status.seen) tick = std::max(tick, status.health.tick);
  }
  return tick;
}

bool Launcher::Ready() const {
  return control_.AllReached(health_t::STATE_READY) &&
         std::ranges::all_of(processes_, [](const auto& each) { return each->StandbyReady(); });
}

bool Launcher::WaitUntilReady() {
  const int64_t start = NowNanoseconds();
  while (!Ready()) {
    if (!Healthy()) return false;
    int64_t kept = 0;
    for (const auto& process : processes_) {
      kept = std::max(kept, process->process().processor_time().waited);
    }
    // What the machine let it wait does not count.
    if (NowNanoseconds() > start + kReadyPatience + kept) {
      std::string names;
      std::vector<std::string> details;
      for (const auto& process : processes_) {
        const bool seen = std::ranges::all_of(process->components(), [&](const auto& name) {
          return control_.statuses().at(name).seen;
        });
        if (seen && process->StandbyReady()) continue;
        names += (names.empty() ? "" : ", ") + process->name() + (seen ? " (its stand-by)" : "");
        for (const std::string& line : LastLines(process->process().log_path(), 1)) {
          details.push_back(process->name() + ": " + line);
        }
      }
      Fail({RunFault::Kind::kHung, names, "was not ready in time"},
           fmt::format("not ready after {} s: {}; run: poise doctor",
                       (NowNanoseconds() - start) / kSecond, names),
           details);
      return false;
    }
    control_.Spin(kSpin);
  }
  return true;
}

bool Launcher::Start() {
  const int64_t start = NowNanoseconds();
  int64_t next = 0;
  // The recorder's first RUNNING is as good as any: it hears START like the others.
  const auto beyond_ready = [&] { return control_.AllReached(health_t::STATE_RUNNING); };
  while (!beyond_ready()) {
    const int64_t now = NowNanoseconds();
    if (!Healthy()) return false;
    if (now > start + kStartTimeout) {
      Fail("the processes did not start together; run: poise doctor");
      return false;
    }
    if (now >= next) {
      if (!control_.SendStart()) {
        Fail("the start could not be sent; is the network up? run: poise doctor");
        return false;
      }
      next = now + kSpin * kSecond / 1000;
    }
    control_.Spin(kSpin);
  }
  outcome_.wall_time = static_cast<double>(start);  // until Watch knows the end
  return true;
}

void Launcher::Watch() {
  const auto start = static_cast<int64_t>(outcome_.wall_time);
  StallWatch stall;
  int64_t ended_at = 0;  // all components, or the run by one of them
  while (true) {
    Wait(kSpin);
    const int64_t now = NowNanoseconds();
    if (ended_at == 0) EndSilent(now);
    if (ended_at == 0) MeasureMemory(now, start);
    if (spec_.realtime() && ended_at == 0) machine_.Sample(now);
    if (kills_ != nullptr && ended_at == 0) kills_->Act(now, now - start, processes_);
    const int64_t tick = Tick();
    const double time = static_cast<double>(tick + 1 - spec_.lead_ticks()) * spec_.tick_period();
    progress_->Show(time, static_cast<double>(now - start) * 1e-9);
    outcome_.wall_time = static_cast<double>((ended_at > 0 ? ended_at : now) - start) * 1e-9;
    if (!Healthy()) return;
    if (RecorderFailed()) return;

    // A component with a reason ends the run for all; without, each has come to the planned end.
    bool all_ended = true;
    bool failed = false;
    RunFault fault;
    std::string reason;
    int index = 0;
    for (const ComponentInstance& instance : spec_.graph().component()) {
      const health_t& health = control_.statuses().at(instance.name()).health;
      // The owner of the clock has the last word: who is late skips the last tick.
      const bool counts = TimingOf(spec_, index++) != Timing::kFollower;
      all_ended = all_ended && (!counts || health.state >= health_t::STATE_FINISHED);
      if (health.state >= health_t::STATE_FINISHED && !health.detail.empty()) {
        failed = failed || health.state == health_t::STATE_FAILED;
        fault = {RunFault::Kind::kStopped, instance.name(), health.detail};
        reason = fmt::format("{}: {}", instance.name(), health.detail);
      }
    }
    if (ended_at == 0 && (all_ended || !reason.empty())) ended_at = now;
    const bool recorded =
        !log_ || control_.statuses().at(kRecorderName).health.state == health_t::STATE_FINISHED;
    if (ended_at > 0 && recorded) {
      outcome_.completed = !failed;
      outcome_.ticks_done = true;
      if (!reason.empty()) Fail(fault, reason);
      return;
    }
    if (ended_at > 0 && now > ended_at + kRecordTimeout) {
      if (!reason.empty()) Fail(fault, reason);
      Fail(fmt::format("the recorder still lacks messages {} s after the end",
                       kRecordTimeout / kSecond));
      return;
    }
    if (ended_at == 0 && stall.Stood(tick, now) > kStallPatience) {
      const std::vector<std::string> waited_for = WaitedFor(now);
      const std::string names = fmt::format("{}", fmt::join(waited_for, ", "));
      const std::string what =
          fmt::format("no tick for {} s: {} waited for", kStallPatience / kSecond,
                      waited_for.size() == 1 ? "it is" : "they are");
      const int64_t theirs = control_.statuses().at(waited_for.front()).health.tick;
      Fail({RunFault::Kind::kHung, names, what},
           fmt::format("no tick for {} s: {} {} waited for{}; the others have come to tick {}",
                       kStallPatience / kSecond, names, waited_for.size() == 1 ? "is" : "are",
                       // Health comes a few times a second: the first may be of no tick yet.
                       theirs < 0 ? ""
                                  : fmt::format(", {} last word is of tick {}",
                                                waited_for.size() == 1 ? "its" : "their", theirs),
                       tick));
      return;
    }
  }
}

void Launcher::Wait(int timeout_ms) {
  std::vector<int> fds;
  for (const auto& process : processes_) {
    if (process->restarts() && process->fd() >= 0) fds.push_back(process->fd());
  }
  if (kills_ != nullptr) fds.push_back(kills_->fd());
  if (crane_ != nullptr && crane_->fd() >= 0) fds.push_back(crane_->fd());
  control_.Spin(kills_ != nullptr ? std::min(timeout_ms, 2) : timeout_ms, fds);
  if (kills_ != nullptr) kills_->Receive();
  if (crane_ != nullptr) crane_->Receive();
}

void Launcher::MeasureMemory(int64_t now, int64_t start) {
  if (now < next_measure_ || now - start < kSettled) return;
  next_measure_ = now + kSecond;
  outcome_.processes.resize(static_cast<size_t>(spec_.graph().component_size()));
  const Graph& graph = spec_.graph();
  for (const auto& process : processes_) {
    const std::vector<int> members = ComponentsOf(graph, process->name());
    if (members.empty()) continue;  // the recorder
    // The memory of several is their first's.
    ProcessReport& report = outcome_.processes[static_cast<size_t>(members.front())];
    report.resident_last = process->ResidentBytes();
    if (report.resident_first == 0) report.resident_first = report.resident_last;
  }
}

void Launcher::ReportProcesses() {
  outcome_.processes.resize(static_cast<size_t>(spec_.graph().component_size()));
  size_t i = 0;
  for (const ComponentInstance& instance : spec_.graph().component()) {
    outcome_.processes[i++].health = control_.statuses().at(instance.name()).health;
  }
}

void Launcher::EndSilent(int64_t now) {
  for (const auto& process : processes_) {
    if (!process->restarts()) continue;
    // All components of a process speak or are silent together.
    const ControlClient::Status& status = control_.statuses().at(process->components().front());
    if (!status.seen || now - status.last_seen < kQuiet) continue;
    ChildProcess& child = process->process();
    const int64_t silent =
        silence_[process.get()].Silent(child.pid(), status.last_seen, child.processor_time(), now);
    if (silent > kSilence) child.Signal(SIGKILL);
  }
}

void Launcher::StopProcesses() {
  for (const auto& process : processes_) process->StopRestarts();
  const auto running = [&] {
    return std::any_of(processes_.begin(), processes_.end(),
                       [](const auto& process) { return !process->process().ended(); });
  };
  const int signals = StopSignalCount();
  const int64_t start = NowNanoseconds();
  bool terminated = false;
  while (running()) {
    const int64_t now = NowNanoseconds();
    const bool hurry = StopSignalCount() > signals + 1;
    if (hurry || now > start + 2 * kStopPatience) break;
    if (now > start + kStopPatience && !terminated) {
      for (const auto& process : processes_) process->process().Signal(SIGTERM);
      terminated = true;
    }
    control_.SendStop();
    control_.Spin(kSpin / 2);
  }
  if (outcome_.completed) {
    for (const auto& component : processes_) {
      ChildProcess* const process = &component->process();
      if (process->ended() && process->succeeded()) continue;
      if (!process->ended()) {
        // It has done all its work: how long it takes to go is the machine's affair.
        outcome_.warning = fmt::format("{} had not stopped {} s after the end and was killed",
                                       process->name(), 2 * kStopPatience / kSecond);
        continue;
      }
      outcome_.completed = false;
      const std::string reason = outcome_.message;
      const RunFault fault = outcome_.fault;  // the run's; its ticks are done
      outcome_.message.clear();
      FailProcess(*component);
      outcome_.fault = fault;
      if (!reason.empty()) outcome_.details.push_back("before that: " + reason);
      break;
    }
  }
  for (const auto& process : processes_) {
    std::ifstream in(process->process().log_path());
    for (std::string line; std::getline(in, line);) {
      if (!line.starts_with(kWarning)) continue;
      outcome_.warnings.push_back(
          fmt::format("{}: {}", process->name(), line.substr(kWarning.size())));
    }
  }
  outcome_.refused = control_.refused();
  if (log_) {
    const health_t& recorder = control_.statuses().at(kRecorderName).health;
    if (recorder.state != health_t::STATE_FAILED) outcome_.strangers = recorder.detail;
  }
  processes_.clear();  // kills what has not ended
}

}  // namespace poise
