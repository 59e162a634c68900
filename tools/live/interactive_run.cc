#include "tools/live/interactive_run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "fmt/format.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/signals.h"
#include "tools/live/control_desk.h"
#include "tools/live/live_start.h"
#include "tools/live/run_status.h"
#include "tools/live/tick_ring.h"
#include "tools/live/view_access.h"
#include "tools/live/view_server.h"
#include "tools/operator/inline_port.h"
#include "tools/report/html_report.h"
#include "tools/run/stage_watch.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPicture{33};
constexpr milliseconds kLongestSlice{10};  // of ticks before the page is served again
constexpr milliseconds kLeastServed{2};    // though the run is behind: it hears its page
constexpr double kMostBehind = 0.1;  // s: a run that is slower than the wall catches up no more
constexpr double kLeastSpeed = 0.1, kMostSpeed = 1;
constexpr int kMostBranches = 8;  // kept beside the log; each may take 3 MB a second of its run

class InteractiveRun {
 public:
  InteractiveRun(const RunSpec& spec, const Scenario& scenario, run_info_t info, std::string log,
                 const InteractiveOptions& options)
      : spec_(spec),
        scenario_(scenario),
        info_(std::move(info)),
        log_(std::move(log)),
        run_id_(std::to_string(spec.run_id())),
        port_(spec, [this](const OperatorAct& act) { return Pace(act); }),
        desk_(&port_),
        ring_(spec, TicksOf(options.keep, spec.tick_period())) {
    Open();
    recorder_->Flush();
    server_ = std::make_unique<ViewServer>(
        options.port,
        LiveHtml(ReadRunStart(log_), scenario, ring_.ChannelsJson(), ring_.capacity()), &ring_,
        ViewControl{MakeToken(), [this](std::string_view text) { return desk_.Receive(text); }});
    status_ = std::make_unique<RunStatus>(log_, scenario_);
  }

  RunOutcome Run() {
    fmt::print("{}\nwhoever has this address can push, change and stop the robot; Ctrl-C ends\n",
               server_->url());
    std::fflush(stdout);
    const auto start = Clock::now();
    auto next_picture = start;
    Anchor();
    while (StopSignal() == 0) {
      const auto now = Clock::now();
      if (now >= next_picture) {
        ShowPicture();
        next_picture = std::max(next_picture + kPicture, Clock::now());
      }
      if (back_) GoBack(*std::exchange(back_, std::nullopt), std::exchange(go_on_, false));
      AdvanceUntil(Due());
      const auto wait = std::min(next_picture, paused_ || runner_->ended() ? next_picture : Next());
      server_->RunFor(std::clamp(std::chrono::duration_cast<milliseconds>(wait - Clock::now()),
                                 kLeastServed, kPicture));
    }
    const bool early = !runner_->ended();
    recorder_->Close(spec_, early ? logging::kEndedByHand : "");
    RunOutcome outcome;
    outcome.wall_time = std::chrono::duration<double>(Clock::now() - start).count();
    outcome.completed = !runner_->failed();
    outcome.message = runner_->end_detail();
    // Before the scenario has begun there is nothing to judge.
    if (early && runner_->ticks_completed() <= spec_.lead_ticks()) {
      outcome.completed = false;
      outcome.interrupted = true;
      outcome.message = fmt::format("interrupted ({})", sigdescr_np(StopSignal()));
    }
    return outcome;
  }

 private:
  /// A fresh run and its log, before the first tick.
  void Open() {
    watch_.reset();
    recorder_.reset();  // which the runner's taps call
    runner_ = std::make_unique<InlineRunner>(spec_, Components());
    recorder_ = std::make_unique<logging::InlineRecorder>(log_, spec_, info_, runner_.get());
    watch_.emplace(spec_, runner_->StageNames(), [this] {
      recorder_->Flush();
      return fmt::format("the log has what came before: {}", log_);
    });
    runner_->set_position(watch_->position());
    port_.SetRunner(runner_.get());
    runner_->set_tap([this](int channel, const OutputPort& output, const Tick& tick) {
      recorder_->Add(channel, output, tick);
      const bool shown = tick.index >= shown_from_;
      if (!shown && !port_.Hears(channel)) return;
      bytes_.resize(static_cast<size_t>(output.encoded_size()));
      output.Encode(bytes_.data(), static_cast<int>(bytes_.size()));
      port_.Hear(channel, bytes_);
      if (shown) Show(channel, tick.index, bytes_);
    });
    runner_->set_external_tap([this](int channel, std::span<const uint8_t> data) {
      recorder_->AddExternal(channel, data);
      port_.Hear(channel, data);
      if (runner_->ticks_completed() >= shown_from_) Show(channel, 0, data);
    });
  }

  void Show(int channel, int64_t tick, std::span<const uint8_t> data) {
    const GraphPlan::ChannelPlan& plan = runner_->plan().channels[static_cast<size_t>(channel)];
    ring_.Add({plan.name, channel, FindMessageType(plan.type), tick, data});
  }

  /// Pace is counted from here on.
  void Anchor() {
    anchor_time_ = Clock::now();
    anchor_tick_ = runner_->ticks_completed();
  }

  std::string Pace(const OperatorAct& act) {
    switch (act.kind) {
      case OperatorAct::Kind::kPause:
        paused_ = true;
        return {};
      case OperatorAct::Kind::kGo:
        if (runner_->ended()) return "the run has ended; go back or start again";
        paused_ = false;
        Anchor();
        return {};
      case OperatorAct::Kind::kTick:
        if (runner_->ended()) return "the run has ended; go back or start again";
        paused_ = true;
        single_ += std::min<int64_t>(act.ticks, ring_.capacity());
        return {};
      case OperatorAct::Kind::kSpeed:
        if (!(act.value >= kLeastSpeed && act.value <= kMostSpeed)) {
          return fmt::format("must lie between {} and {}", kLeastSpeed, kMostSpeed);
        }
        speed_ = act.value;
        Anchor();
        return {};
      case OperatorAct::Kind::kRestart:
        back_ = 0;
        go_on_ = true;
        return {};
      default:
        if (act.ticks > runner_->ticks_completed()) return "that tick has not been yet";
        back_ = act.ticks;
        go_on_ = false;
        return {};
    }
  }

  /// Ticks that are to be done by now.
  int64_t Due() {
    if (paused_) return runner_->ticks_completed() + std::exchange(single_, 0);
    const double passed = std::chrono::duration<double>(Clock::now() - anchor_time_).count();
    const int64_t due = anchor_tick_ + static_cast<int64_t>(passed * speed_ / spec_.tick_period());
    const double behind =
        static_cast<double>(due - runner_->ticks_completed()) * spec_.tick_period();
    if (behind > kMostBehind) Anchor();
    return behind > kMostBehind ? runner_->ticks_completed() + 1 : due;
  }
  Clock::time_point Next() const {
    const auto ticks = static_cast<double>(runner_->ticks_completed() + 1 - anchor_tick_);
    return anchor_time_ + std::chrono::duration_cast<Clock::duration>(
                              std::chrono::duration<double>(ticks * spec_.tick_period() / speed_));
  }

  void AdvanceUntil(int64_t due) {
    const auto until = Clock::now() + kLongestSlice;
    while (runner_->ticks_completed() < due && !runner_->ended()) {
      runner_->Step();
      if (!paused_ && Clock::now() > until) break;
    }
    if (runner_->ended()) paused_ = true;
    if (runner_->ended() && !finished_) {
      finished_ = true;
      recorder_->Flush();
      status_->Finish();
    }
  }

  /// `tick` ticks done, as they were; waits there unless it goes on.
  void GoBack(int64_t tick, bool go_on) {
    status_.reset();  // it reads the log
    server_->SetStatus(StatusText(run_id_, {{"ended", false}}));
    recorder_->Close(spec_);
    ++branch_;
    again_ = tick;
    const fs::path folder = fs::path(log_).parent_path();
    const auto name = [&](int64_t branch) { return folder / fmt::format("branch_{}.lcm", branch); };
    std::error_code ignored;  // of one that somebody has removed
    fs::rename(log_, name(branch_), ignored);
    if (branch_ > kMostBranches) fs::remove(name(branch_ - kMostBranches), ignored);
    port_.Forget(tick);
    ring_ = TickRing(spec_, ring_.capacity());
    shown_from_ = std::max<int64_t>(0, tick - ring_.capacity());
    Open();
    server_->Restart();
    auto next_picture = Clock::now();
    while (runner_->ticks_completed() < tick && StopSignal() == 0) {
      port_.Repeat(runner_->ticks_completed());
      if (!runner_->Step()) break;
      if (Clock::now() < next_picture) continue;
      ShowPicture();
      server_->RunFor(milliseconds(0));
      next_picture = Clock::now() + kPicture;
    }
    again_ = -1;
    finished_ = false;
    status_ = std::make_unique<RunStatus>(log_, scenario_);
    shown_from_ = 0;
    single_ = 0;
    paused_ = !go_on;
    Anchor();
  }

  void ShowPicture() {
    recorder_->Flush();
    server_->SetState(nlohmann::ordered_json({{"run_id", run_id_},
                                              {"state", "live"},
                                              {"lost", ring_.lost()},
                                              {"end_tick", ring_.end_tick()},
                                              {"branch", branch_}})
                          .dump());
    port_.Update(0);
    if (const std::optional<std::string> text = desk_.Take(run_id_, RunJson())) {
      server_->SetControl(*text);
    }
    if (auto status = status_ ? status_->Take() : std::nullopt) {
      server_->SetStatus(StatusText(run_id_, std::move(*status)));
    }
    server_->SendTicks();
  }

  nlohmann::ordered_json RunJson() const {
    return {{"paused", paused_},
            {"speed", speed_},
            {"branch", branch_},
            {"ended", runner_->ended()},
            {"detail", runner_->end_detail()},
            {"can_go_back", !back_.has_value()},
            {"again", again_},
            // A tick that changes thirty times a second is the stream's to tell.
            {"tick", paused_ ? runner_->ticks_completed() : -1}};
  }

  const RunSpec spec_;
  const Scenario scenario_;
  const run_info_t info_;
  const std::string log_;
  const std::string run_id_;
  InlinePort port_;
  ControlDesk desk_;
  TickRing ring_;
  std::unique_ptr<InlineRunner> runner_;
  std::unique_ptr<logging::InlineRecorder> recorder_;
  std::optional<StageWatch> watch_;
  std::unique_ptr<ViewServer> server_;
  std::unique_ptr<RunStatus> status_;  // null while the run goes back
  bool finished_ = false;              // status_ has been told of the end
  std::vector<uint8_t> bytes_;
  bool paused_ = false;
  double speed_ = 1;
  int64_t single_ = 0;  // ticks to run while it waits
  std::optional<int64_t> back_;
  bool go_on_ = false;  // once it is back
  int64_t branch_ = 0;
  int64_t again_ = -1;      // tick up to which the run is being made again; -1: it is not
  int64_t shown_from_ = 0;  // tick
  Clock::time_point anchor_time_{};
  int64_t anchor_tick_ = 0;
};

}  // namespace

RunOutcome RunInteractive(const RunSpec& spec, const Scenario& scenario, const run_info_t& info,
                          const std::string& log, const InteractiveOptions& options) {
  return InteractiveRun(spec, scenario, info, log, options).Run();
}

}  // namespace poise
