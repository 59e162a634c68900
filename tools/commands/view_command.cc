#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_style.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/foxglove/live_foxglove.h"
#include "tools/live/control_desk.h"
#include "tools/live/live_start.h"
#include "tools/live/run_status.h"
#include "tools/live/tick_ring.h"
#include "tools/live/view_access.h"
#include "tools/live/view_server.h"
#include "tools/operator/bus_port.h"
#include "tools/report/html_report.h"
#include "tools/run/live_run.h"

namespace poise {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;
using std::chrono::milliseconds;

constexpr const char* kLogCommand = "poise report";
constexpr milliseconds kPicture{33};
// The pause between two looks at the bus: too short for its buffer to fill, and few wake-ups beside
// the run.
constexpr milliseconds kPause{4};
constexpr milliseconds kViewSilence{500};  // then it is asked whether the run goes on
constexpr milliseconds kViewPatience{5'000};

struct ViewOptions {
  std::string run;
  int port = 0;
  double keep = 60;  // s
  int foxglove = 0;  // port; 0: none
  std::vector<std::string> foxglove_origins;
  bool control = false;
};

class Viewer {
 public:
  Viewer(const ViewOptions& options, LiveRun* live, const logging::RunRecord& record,
         const Scenario& scenario)
      : live_(live),
        keep_(options.keep),
        run_id_(std::to_string(live->spec().run_id())),
        port_(options.control ? std::make_unique<BusPort>(live->spec()) : nullptr),
        desk_(port_ ? std::make_unique<ControlDesk>(port_.get()) : nullptr),
        ring_(live->spec(), TicksOf(options.keep, live->spec().tick_period())),
        server_(options.port, LiveHtml(record, scenario, ring_.ChannelsJson(), ring_.capacity()),
                &ring_, Control()),
        status_((live->dir() / "run.lcm").string(), scenario) {
    if (port_) port_->FollowSettings();
    if (options.foxglove == 0) return;
    foxglove_ = std::make_unique<LiveFoxglove>(options.foxglove, options.foxglove_origins, record,
                                               scenario);
  }

  int Run() {
    const double size =
        1e-6 * static_cast<double>(ring_.tick_size()) * static_cast<double>(ring_.capacity());
    fmt::print("{}\n", server_.url());
    Say(fmt::format("the page of {}, its last {} s ({:.0f} MB); Ctrl-C ends", live_->dir().string(),
                    keep_, size));
    if (foxglove_) fmt::print("Foxglove: ws://127.0.0.1:{}\n", foxglove_->port());
    if (desk_) fmt::print("whoever has this address can push, change and stop the robot\n");
    std::fflush(stdout);
    server_.SetState(State());
    auto next_picture = Clock::now();
    last_message_ = next_picture;
    while (StopSignal() == 0) {
      server_.RunFor(live_ != nullptr ? kPause : kPicture);
      const auto now = Clock::now();
      if (live_ != nullptr) Listen(now);
      if (foxglove_) foxglove_->Poll();
      if (now < next_picture) continue;
      SendStatus();
      SendControl();
      server_.SendTicks();
      if (server_.dropped() != dropped_) {
        dropped_ = server_.dropped();
        fmt::print(stderr, "a browser that took no ticks was dropped; its page connects again\n");
      }
      next_picture = std::max(next_picture + kPicture, now);
    }
    return kExitOk;
  }

 private:
  static void Say(const std::string& text) { fmt::print("{}", ScreenLines(2, "{}", text)); }

  void Listen(Clock::time_point now) {
    const int64_t lost = ring_.lost();
    live_->Spin(0, [&](const LiveMessage& message) {
      ring_.Add(message);
      if (foxglove_) foxglove_->Add(message);
      last_message_ = now;
    });
    if (port_) port_->Update(0);
    if (now > last_message_ + kViewSilence) {
      last_message_ = now;
      if (!live_->InProgress()) {
        ring_.Finish();
        status_.Finish();
        if (foxglove_) foxglove_->Finish();
        Say(fmt::format("the run has ended; its page stays until Ctrl-C; {} {} checks it",
                        kLogCommand, live_->dir().string()));
        std::fflush(stdout);
        live_ = nullptr;
      }
    }
    if (ring_.lost() != lost || live_ == nullptr) server_.SetState(State());
  }

  void SendStatus() {
    std::optional<Json> status = status_.Take();
    if (!status) return;
    if (foxglove_) foxglove_->AddStatus(*status);
    server_.SetStatus(StatusText(run_id_, std::move(*status)));
  }

  ViewControl Control() {
    if (!desk_) return {};
    return {MakeToken(), [this](std::string_view text) { return desk_->Receive(text); }};
  }

  void SendControl() {
    if (!desk_ || live_ == nullptr) return;
    if (const std::optional<std::string> text = desk_->Take(run_id_)) server_.SetControl(*text);
  }

  std::string State() const {
    return Json({{"run_id", run_id_},
                 {"state", live_ != nullptr ? "live" : "ended"},
                 {"lost", ring_.lost()},
                 {"end_tick", ring_.end_tick()}})
        .dump();
  }

  LiveRun* live_;  // nullptr: the run has ended
  double keep_;    // s
  std::string run_id_;
  int64_t dropped_ = 0;
  std::unique_ptr<BusPort> port_;  // nullptr: pages only look
  std::unique_ptr<ControlDesk> desk_;
  TickRing ring_;
  ViewServer server_;
  RunStatus status_;
  std::unique_ptr<LiveFoxglove> foxglove_;  // null unless asked for
  Clock::time_point last_message_;
};

int View(const ViewOptions& options) {
  CatchStopSignals();
  LiveRun live(options.run, kLogCommand, "poise view");
  const logging::RunRecord record = ReadStart(live, kViewPatience);
  const Scenario scenario = ReadScenario(live, record);
  StandBack();
  return Viewer(options, &live, record, scenario).Run();
}

}  // namespace

void AddViewCommand(CLI::App* app, Command* command) {
  const auto [view, options] = AddCommand<ViewOptions>(
      app, command, "view", "the page of a run in progress, live in a browser on this machine",
      View);
  view->add_option("run", options->run,
                   "folder or name of the run; default: the only one that goes on");
  view->add_option("--port", options->port, "on 127.0.0.1; default: a free one")
      ->check(CLI::Range(1, 65535));
  view->add_option("--keep", options->keep, "s of the run that the page can look back")
      ->check(Within("in [1, 600]", [](double s) { return s >= 1 && s <= 600; }))
      ->capture_default_str();
  view->add_option("--foxglove", options->foxglove,
                   "serve Foxglove's WebSocket on this port of 127.0.0.1 as well; its own is 8765")
      ->check(CLI::Range(1, 65535));
  AddList(view, "--foxglove-origin", &options->foxglove_origins,
          "origin of further pages that may connect there, e.g. https://viewer.example");
  view->add_flag("--control", options->control,
                 "pages with the token of the printed address may push, change settings and stop");
  SetExample(view, "poise view --control");
}

}  // namespace poise
