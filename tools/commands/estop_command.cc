#include <poll.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"
#include "tools/commands/commands.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_registry.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns
constexpr int64_t kStopPatience = 3 * kSecond;
constexpr int64_t kLow = kSecond / 5;  // before the edge of a reset
constexpr int kRepeat = 20;            // ms

int FindChannel(const Graph& graph, const std::string& type, bool external) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type && graph.channel(i).external() == external) return i;
  }
  throw ConfigError(fmt::format("graph {}: has no{} channel of type {}", graph.name(),
                                external ? " external" : "", type));
}

/// The operator's line to a running bridge.
class Line {
 public:
  /// Throws ConfigError when no bridge can be reached from here.
  explicit Line(const std::string& run) : run_(run), spec_(ReadNetworkedSpec(run)) {
    const int channel = FindChannel(spec_.graph(), "emergency_stop_t", true);
    name_ = spec_.graph().channel(channel).name();
    url_ = ChannelUrl(spec_, channel);
    sender_ = std::make_unique<BusSender>(url_);
    answers_ = std::make_unique<BusReceiver>(
        ChannelUrl(spec_, FindChannel(spec_.graph(), "bridge_status_t", false)), OfRun(spec_));
  }

  /// "run 42 (push_double_support, FOLDER)"
  std::string Name() const {
    return fmt::format("run {} ({}{}{})", spec_.run_id(), logging::ForTerminal(spec_.scenario()),
                       run_.empty() ? "" : ", ", logging::ForTerminal(run_));
  }

  void Send(bool stop, bool reset) {
    emergency_stop_t message{};
    message.run_id = spec_.run_id();
    message.stop = stop ? 1 : 0;
    message.reset = reset ? 1 : 0;
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    // Noted, not thrown: the other runs get theirs.
    sent_ = (own_sender_ ? own_sender_->Send(name_, bytes.data(), bytes.size())
                         : sender_->Send(name_.c_str(), bytes.data(), bytes.size())) ||
            sent_;
  }
  /// Sends as one of the run's own from here on: a stop is taken from everybody, its end is not.
  /// Where that cannot be, refusal() tells why.
  void JoinRun() {
    try {
      socket_.emplace(RunSocket::Ask(spec_));
      own_sender_.emplace(*socket_, url_);
    } catch (const BusError& error) {
      refusal_ = error.what();
    }
  }
  const std::string& refusal() const { return refusal_; }
  bool sent() const { return sent_; }
  /// Nothing holds the lock on the run's folder.
  bool Ended() const {
    const std::filesystem::path path(run_);
    std::error_code error;
    return !RunInProgress(std::filesystem::is_directory(path, error) ? path : path.parent_path());
  }
  int fd() const { return answers_->fd(); }
  /// Takes what the bridge has answered.
  void Hear() {
    BusReceiver::Packet packet;
    while (answers_->Receive(&packet)) {
      bridge_status_t status;
      if (DecodeChecked(packet.data, static_cast<int64_t>(packet.size), &status) &&
          status.run_id == spec_.run_id()) {
        status_ = status;
      }
    }
  }
  /// The bridge's last word; empty: none was heard.
  const std::optional<bridge_status_t>& status() const { return status_; }

 private:
  static RunSpec ReadNetworkedSpec(const std::string& run) {
    RunSpec spec = ReadRunSpec(run);
    if (spec.first_port() != 0) return spec;
    throw ConfigError(
        fmt::format("run {}: runs inside one process; end that with Ctrl-C", spec.run_id()));
  }

  std::string run_;
  RunSpec spec_;
  std::string name_, url_;
  std::unique_ptr<BusSender> sender_;
  std::string refusal_;
  std::optional<RunSocket> socket_;
  std::optional<RunSender> own_sender_;
  std::unique_ptr<BusReceiver> answers_;
  std::optional<bridge_status_t> status_;
  bool sent_ = false;
};

/// Whether the status of lines[line] says that what was asked for has come.
using Done = std::function<bool(size_t line, const Line&)>;

/// Sends the message to all, again and again, until `done` holds of every line's status. Returns
/// whether that came within `patience` ns.
bool SendUntil(std::vector<Line>& lines, bool stop, bool reset, int64_t patience,
               const Done& done) {
  const int64_t deadline = NowNanoseconds() + patience;
  std::vector<bool> reached(lines.size(), false);
  while (NowNanoseconds() < deadline) {
    std::vector<pollfd> fds;
    // All first: no run waits for another's answer.
    for (size_t i = 0; i < lines.size(); ++i) {
      if (reached[i]) continue;
      lines[i].Send(stop, reset);
      fds.push_back({lines[i].fd(), POLLIN, 0});
    }
    poll(fds.data(), fds.size(), kRepeat);
    for (size_t i = 0; i < lines.size(); ++i) {
      lines[i].Hear();
      reached[i] = reached[i] || (lines[i].status() && done(i, lines[i]));
    }
    if (std::find(reached.begin(), reached.end(), false) == reached.end()) return true;
  }
  return false;
}

constexpr char kUnsent[] = "the message could not be sent; is the network up? run: poise doctor";

bool Stops(const Line& line) {
  return line.status() && line.status()->state >= bridge_status_t::STATE_STOPPING;
}

int Stop(std::vector<Line>& lines) {
  SendUntil(lines, true, false, kStopPatience,
            [](size_t, const Line& line) { return Stops(line); });
  int exit_code = kExitOk;
  for (const Line& line : lines) {
    if (Stops(line)) {
      fmt::print("{}: the bridge has stopped the robot\n", line.Name());
      continue;
    }
    const std::string problem =
        !line.sent()   ? kUnsent
        : line.Ended() ? "this run has ended"
                       : fmt::format(
                             "the stop was sent, but no bridge has confirmed it for {} s; "
                             "does the run's reference still go on?",
                             kStopPatience / kSecond);
    fmt::print(stderr, "poise: {}: {}\n", line.Name(), problem);
    exit_code = kExitFailed;
  }
  return exit_code;
}

int Reset(std::vector<Line>& lines) {
  for (Line& line : lines) line.JoinRun();
  // The edge: low for a while, then high.
  SendUntil(lines, false, false, kLow, [](size_t, const Line&) { return false; });
  std::vector<int64_t> resets;
  for (const Line& line : lines) resets.push_back(line.status() ? line.status()->resets : 0);
  const auto is_reset = [&](size_t i, const Line& line) {
    return line.status() && line.status()->resets > resets[i];
  };
  SendUntil(lines, false, true, kStopPatience, is_reset);
  int exit_code = kExitOk;
  for (size_t i = 0; i < lines.size(); ++i) {
    const Line& line = lines[i];
    if (is_reset(i, line)) {
      fmt::print("{}: the stop is reset; the bridge follows commands again\n", line.Name());
      continue;
    }
    const std::string problem =
        !line.refusal().empty() ? line.refusal()
        : !line.sent()          ? kUnsent
        : line.Ended()          ? "this run has ended"
        : !line.status()        ? "no bridge has answered; does the run's reference still go on?"
        : !Stops(line)          ? "there is no stop to reset"
                       : "the bridge keeps its stop; it resets only when its motors are at rest "
                         "and no torque is commanded";
    fmt::print(stderr, "poise: {}: {}\n", line.Name(), problem);
    exit_code = kExitFailed;
  }
  return exit_code;
}

/// Lines to every run of this user that goes on. What cannot be reached goes to stderr and lets
/// `exit_code` fail: no run is passed over in silence.
std::vector<Line> AllLines(int* exit_code) {
  const std::vector<RunningRun> runs = RunningRuns();
  const bool any_own =
      std::any_of(runs.begin(), runs.end(), [](const RunningRun& run) { return run.own; });
  if (!any_own) OnlyRunningRun("poise log info", "poise estop");  // throws what there is instead
  std::vector<Line> lines;
  for (const RunningRun& run : runs) {
    if (!run.own) {
      fmt::print(stderr, "poise: another user's run goes on too; to stop it: poise estop {}\n",
                 logging::ForTerminal(run.dir.string()));
      continue;
    }
    if (run.readable && !run.networked) {
      fmt::print(stderr,
                 "poise: {}: runs inside one process, without a bridge to stop; end that "
                 "with Ctrl-C\n",
                 logging::ForTerminal(run.dir.string()));
      continue;
    }
    try {
      lines.emplace_back(run.dir.string());
    } catch (const std::exception& error) {
      fmt::print(stderr, "poise: {}: cannot be reached: {}\n",
                 logging::ForTerminal(run.dir.string()), logging::LinesForTerminal(error.what()));
      *exit_code = kExitFailed;
    }
  }
  if (lines.empty()) *exit_code = kExitFailed;
  return lines;
}

int Estop(const std::string& run, bool reset) {
  int exit_code = kExitOk;
  std::vector<Line> lines;
  if (run.empty()) {
    lines = AllLines(&exit_code);
  } else {
    // It asks for none of several that are called so: a stop must not wait for an answer.
    for (const std::filesystem::path& dir : RunsNamed(run)) lines.emplace_back(dir.string());
  }
  if (lines.empty()) return exit_code;
  const int done = reset ? Reset(lines) : Stop(lines);
  return done != kExitOk ? done : exit_code;
}

}  // namespace

void AddEstopCommand(CLI::App* app, Command* command) {
  auto run = std::make_shared<std::string>();
  auto reset = std::make_shared<bool>(false);
  CLI::App* estop = app->add_subcommand(
      "estop", "emergency stop of your runs that go on, or of one run (latched)");
  estop->add_option("run", *run,
                    "folder or name of the run, also another user's; default: every run of yours");
  estop->add_flag("--reset", *reset,
                  "end a stop: only once the motors are at rest and no torque is commanded");
  estop->callback(
      [run, reset, command] { *command = [run, reset] { return Estop(*run, *reset); }; });
}

}  // namespace poise
