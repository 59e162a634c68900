#include "tools/run/launcher.h"

#include <algorithm>
#include <csignal>
#include <cstring>

#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "components/framework/runners/timing.h"
#include "fmt/format.h"
#include "tools/cli/signals.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns
constexpr int64_t kReadyTimeout = 30 * kSecond;
constexpr int64_t kStartTimeout = 10 * kSecond;
constexpr int64_t kStallTimeout = 20 * kSecond;  // of wall time without a tick
constexpr int64_t kRecordTimeout = 10 * kSecond;
constexpr int64_t kStopPatience = 2 * kSecond;  // before SIGTERM, and again before SIGKILL
constexpr int64_t kSettled = 10 * kSecond;      // memory is measured from here on
constexpr int64_t kSilence = 2 * kSecond;       // of a process that can be replaced
constexpr int kSpin = 20;                       // ms
constexpr size_t kDetailLines = 5;

}  // namespace

Launcher::Launcher(const RunSpec& spec, LaunchFiles files, const LaunchOptions& options,
                   Progress* progress)
    : spec_(spec),
      files_(std::move(files)),
      progress_(progress),
      control_(spec,
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
                         bool restart = false) {
    command[0] = files_.program_dir + "/" + command[0];
    processes_.push_back(std::make_unique<ComponentProcess>(
        name, command, fmt::format("{}/{}.log", files_.run_dir, name), restart));
  };
  if (log_) {
    start(kRecorderName,
          {"recorder", "--run", files_.spec_file, "--scenario", files_.scenario_file, "--log",
           files_.run_dir + "/run.lcm", "--report", files_.run_dir + "/recorder.json"});
  }
  // In lockstep a successor would lack the messages of its tick; and the run can be repeated.
  for (const ComponentInstance& instance : spec_.graph().component()) {
    start(instance.name(),
          {TypeOf(instance), "--run", files_.spec_file, "--component", instance.name()},
          spec_.realtime() && instance.restart());
  }
}

void Launcher::Fail(std::string message, std::vector<std::string> details) {
  if (!outcome_.message.empty()) return;
  outcome_.message = std::move(message);
  outcome_.details = std::move(details);
}

void Launcher::FailProcess(ChildProcess& process) {
  const health_t& health = control_.statuses().at(process.name()).health;
  if (health.state == health_t::STATE_FAILED && !health.detail.empty()) {
    Fail(fmt::format("{}: {}", process.name(), health.detail));
    return;
  }
  const int64_t tick = Tick();
  Fail(fmt::format("{} {}{}; its output: {}", process.name(), process.HowItEnded(),
                   tick < 0
                       ? " before the start"
                       : fmt::format(" at {:.3f} s",
                                     MakeTick(tick, spec_.tick_period(), spec_.lead_ticks()).time),
                   process.log_path()),
       LastLines(process.log_path(), kDetailLines));
}

bool Launcher::Healthy() {
  if (StopSignal() != 0) {
    outcome_.interrupted = true;
    Fail(fmt::format("interrupted ({})", sigdescr_np(StopSignal())));
    return false;
  }
  // One that died first may have others follow: a non-zero end names the culprit best.
  const int64_t now = NowNanoseconds();
  ChildProcess* dead = nullptr;
  outcome_.takeovers = 0;
  for (const auto& process : processes_) {
    if (!process->Alive(now) && (dead == nullptr || dead->succeeded())) dead = &process->process();
    outcome_.takeovers += process->takeovers();
  }
  if (dead != nullptr) FailProcess(*dead);
  return dead == nullptr;
}

bool Launcher::RecorderFailed() {
  if (!log_) return false;
  const health_t& health = control_.statuses().at(kRecorderName).health;
  if (health.state != health_t::STATE_FAILED) return false;
  Fail(fmt::format("the recorder cannot go on: {}", health.detail));
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
  const int64_t deadline = NowNanoseconds() + kReadyTimeout;
  while (!Ready()) {
    if (!Healthy()) return false;
    if (NowNanoseconds() > deadline) {
      std::string names;
      std::vector<std::string> details;
      for (const auto& process : processes_) {
        const bool seen = control_.statuses().at(process->name()).seen;
        if (seen && process->StandbyReady()) continue;
        names += (names.empty() ? "" : ", ") + process->name() + (seen ? " (its stand-by)" : "");
        for (const std::string& line : LastLines(process->process().log_path(), 1)) {
          details.push_back(process->name() + ": " + line);
        }
      }
      Fail(fmt::format("not ready after {} s: {}; run: poise doctor", kReadyTimeout / kSecond,
                       names),
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
  int64_t last_tick = -1;
  int64_t last_change = NowNanoseconds();
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
    std::string reason;
    int index = 0;
    for (const ComponentInstance& instance : spec_.graph().component()) {
      const health_t& health = control_.statuses().at(instance.name()).health;
      // The owner of the clock has the last word: who is late skips the last tick.
      const bool counts = TimingOf(spec_, index++) != Timing::kFollower;
      all_ended = all_ended && (!counts || health.state >= health_t::STATE_FINISHED);
      if (health.state >= health_t::STATE_FINISHED && !health.detail.empty()) {
        failed = failed || health.state == health_t::STATE_FAILED;
        reason = fmt::format("{}: {}", instance.name(), health.detail);
      }
    }
    if (ended_at == 0 && (all_ended || !reason.empty())) ended_at = last_change = now;
    const bool recorded =
        !log_ || control_.statuses().at(kRecorderName).health.state == health_t::STATE_FINISHED;
    if (ended_at > 0 && recorded) {
      outcome_.completed = !failed;
      if (!reason.empty()) Fail(reason);
      return;
    }
    if (ended_at > 0 && now > ended_at + kRecordTimeout) {
      if (!reason.empty()) Fail(reason);
      Fail(fmt::format("the recorder still lacks messages {} s after the end",
                       kRecordTimeout / kSecond));
      return;
    }
    if (tick != last_tick) {
      last_tick = tick;
      last_change = now;
    } else if (now > last_change + kStallTimeout) {
      std::string standing;
      for (const auto& [name, status] : control_.statuses()) {
        standing += fmt::format("{}{} {}", standing.empty() ? "" : ", ", name, status.health.tick);
      }
      Fail(fmt::format("no tick for {} s; last ticks: {}", kStallTimeout / kSecond, standing));
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
  for (size_t i = 0; i < outcome_.processes.size(); ++i) {
    ProcessReport& report = outcome_.processes[i];
    const ComponentProcess& process = *processes_[i + (log_ ? 1 : 0)];
    report.resident_last = process.ResidentBytes();
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
    const ControlClient::Status& status = control_.statuses().at(process->name());
    if (status.seen && now - status.last_seen > kSilence) process->process().Signal(SIGKILL);
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
      outcome_.completed = false;
      const std::string reason = outcome_.message;
      outcome_.message.clear();
      if (process->ended()) {
        FailProcess(*process);
      } else {
        Fail(fmt::format("{} did not stop after the end and was killed; its output: {}",
                         process->name(), process->log_path()),
             LastLines(process->log_path(), kDetailLines));
      }
      if (!reason.empty()) outcome_.details.push_back("before that: " + reason);
      break;
    }
  }
  outcome_.refused = control_.refused();
  processes_.clear();  // kills what has not ended
}

}  // namespace poise
