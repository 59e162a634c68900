#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_style.h"
#include "tools/cli/signals.h"
#include "tools/cli/terminal.h"
#include "tools/commands/commands.h"
#include "tools/live/live_statistics.h"
#include "tools/live/top_view.h"
#include "tools/run/live_run.h"

namespace poise {
namespace {

constexpr int64_t kMillisecond = 1'000'000;           // ns
constexpr int64_t kLongestWait = 50;                  // ms, until keys are looked at
constexpr int64_t kTopSilence = 1000 * kMillisecond;  // then it is asked whether the run goes on

struct TopOptions {
  std::string run;
  double interval = 0.5;  // s
  bool once = false;
};

/// Listens to a run and sums up.
class Watch {
 public:
  explicit Watch(const std::string& run)
      : live_(run, "poise log info", "poise top"),
        control_(live_.spec(), nullptr, {kRecorderName}),
        names_(logging::ElementNames::OfSpec(live_.spec())),
        statistics_(live_.spec(), NowNanoseconds()),
        last_arrival_(NowNanoseconds()) {}

  const LiveRun& live() const { return live_; }

  /// Receives until `deadline`, ns, but not for longer than kLongestWait.
  void Spin(int64_t deadline) {
    const int64_t wait = std::max<int64_t>(0, deadline - NowNanoseconds()) / kMillisecond;
    live_.Spin(static_cast<int>(std::min(wait, kLongestWait)), [&](const LiveMessage& message) {
      last_arrival_ = NowNanoseconds();
      if (message.index < 0) return;  // health comes from the processes themselves
      bridge_status_t bridge;
      if (message.type->fingerprint == bridge_status_t::getHash() &&
          DecodeChecked(message.data, &bridge)) {
        statistics_.SetBridge(bridge);
      }
      bus_status_t bus;
      if (message.type->fingerprint == bus_status_t::getHash() &&
          DecodeChecked(message.data, &bus)) {
        statistics_.SetBus(bus);
      }
      statistics_.AddMessage(message.index, message.tick, message.data.size(), last_arrival_);
    });
    control_.Spin(0);
    for (const auto& [name, status] : control_.statuses()) statistics_.SetProcess(name, status);
  }

  std::vector<ViewLine> View() {
    return TopView(live_.spec(), names_, live_.dir().string(), statistics_.Take(NowNanoseconds()),
                   live_.refused() + control_.refused());
  }
  bool HeardNothing() const {
    return std::none_of(control_.statuses().begin(), control_.statuses().end(),
                        [](const auto& entry) { return entry.second.seen; });
  }
  bool Ended() const {
    return NowNanoseconds() > last_arrival_ + kTopSilence && !live_.InProgress();
  }

 private:
  LiveRun live_;
  ControlClient control_;
  logging::ElementNames names_;
  LiveStatistics statistics_;
  int64_t last_arrival_;
};

int Once(const TopOptions& options) {
  Watch watch(options.run);
  const int64_t end =
      NowNanoseconds() + static_cast<int64_t>(options.interval * 1e3) * kMillisecond;
  while (NowNanoseconds() < end && StopSignal() == 0) watch.Spin(end);
  if (StopSignal() != 0) return kExitFailed;
  fmt::print("{}", PlainText(watch.View(), ScreenStyle().columns));
  if (!watch.HeardNothing()) return kExitOk;
  fmt::print(stderr,
             "poise: run {}: no process was heard of in {} s; try a longer --interval, or look at "
             "the network with poise doctor\n",
             watch.live().spec().run_id(), options.interval);
  return kExitFailed;
}

int Top(const TopOptions& options) {
  CatchStopSignals();
  if (options.once) return Once(options);
  signal(SIGPIPE, SIG_IGN);  // a terminal that goes away shows as an error of the write
  Watch watch(options.run);
  if (isatty(STDOUT_FILENO) == 0) {
    throw ConfigError("top: stdout is no terminal; take one snapshot with --once");
  }
  const auto interval = static_cast<int64_t>(options.interval * 1e3) * kMillisecond;
  std::vector<ViewLine> view = watch.View();
  bool ended = false;
  {
    FullScreen screen;
    int64_t next = 0;
    bool quit = false, moved = false;
    ViewScroll scroll;
    while (!quit && !ended && StopSignal() == 0) {
      const bool due = NowNanoseconds() >= next;
      if (due) {
        next = NowNanoseconds() + interval;
        view = watch.View();
      }
      const FullScreen::Size size = screen.size();
      if (due || moved) quit = !screen.Show(Frame(view, size.columns, size.rows, &scroll));
      watch.Spin(next);
      moved = false;
      while (const char key = screen.Key()) {
        quit = quit || key == 'q' || key == 'Q';
        scroll.Move(key, size.rows / 2);
        moved = true;
      }
      ended = watch.Ended();
    }
  }
  if (!ended) return kExitOk;
  fmt::print("{}\nThe run has ended; its table: poise report {}\n",
             PlainText(view, ScreenStyle().columns), watch.live().dir().string());
  return kExitOk;
}

}  // namespace

void AddTopCommand(CLI::App* app, Command* command) {
  const auto [top, options] = AddCommand<TopOptions>(
      app, command, "top",
      "live view of a run in progress: its processes and channels; arrows scroll, q or Ctrl-C ends "
      "it",
      Top);
  top->add_option("run", options->run,
                  "folder or name of the run; default: the only one that goes on");
  top->add_option("--interval", options->interval, "s between views, over which rates are measured")
      ->capture_default_str()
      ->check(Within("in [0.1, 60]", [](double s) { return s >= 0.1 && s <= 60; }));
  top->add_flag("--once", options->once, "measure for one interval, print the view and end");
  top->footer(
      "Latencies: of one tick's work, from a process's last input to its outputs sent, since the "
      "start. LATE: cycles of the clock's owner that missed their deadline, in real time. GAPS: "
      "messages asked for again; RESENT: answered again; DROPPED: on purpose "
      "(--drop); "
      "UNSENT: refused by the system; MISSED: messages that this view did not get in time (the run "
      "is not affected and the log has them).\nExample: poise top --interval 1");
}

}  // namespace poise
