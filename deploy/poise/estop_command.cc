#include <poll.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/clock.h"
#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "components/framework/udp_bus.h"
#include "deploy/poise/commands.h"
#include "deploy/poise/run_dir.h"
#include "fmt/format.h"
#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns
constexpr int64_t kPatience = 3 * kSecond;
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
  explicit Line(const RunSpec& spec)
      : channel_(FindChannel(spec.graph(), "emergency_stop_t", true)),
        name_(spec.graph().channel(channel_).name()),
        run_id_(spec.run_id()),
        sender_(ChannelUrl(spec, channel_)),
        answers_(ChannelUrl(spec, FindChannel(spec.graph(), "bridge_status_t", false))) {}

  /// Sends the message again and again until the bridge's status satisfies `done`. False: it has
  /// not within `patience` ns.
  template <class Done>
  bool SendUntil(bool stop, bool reset, int64_t patience, Done done) {
    emergency_stop_t message{};
    message.run_id = run_id_;
    message.stop = stop ? 1 : 0;
    message.reset = reset ? 1 : 0;
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    const int64_t deadline = NowNanoseconds() + patience;
    while (NowNanoseconds() < deadline) {
      if (!sender_.Send(name_.c_str(), bytes.data(), bytes.size())) {
        throw BusError("the message could not be sent; is the network up? run: poise doctor");
      }
      pollfd fd{answers_.fd(), POLLIN, 0};
      poll(&fd, 1, kRepeat);
      BusReceiver::Packet packet;
      while (answers_.Receive(&packet)) {
        bridge_status_t status;
        if (!DecodeChecked(packet.data, static_cast<int64_t>(packet.size), &status) ||
            status.run_id != run_id_) {
          continue;
        }
        status_ = status;
        if (done(status)) return true;
      }
    }
    return false;
  }
  /// The bridge's last word; empty: none was heard.
  const std::optional<bridge_status_t>& status() const { return status_; }

 private:
  int channel_;
  std::string name_;
  int64_t run_id_;
  BusSender sender_;
  BusReceiver answers_;
  std::optional<bridge_status_t> status_;
};

int Estop(const std::string& run, bool reset) {
  const RunSpec spec = ReadRunSpec(run);
  if (spec.first_port() == 0) {
    throw ConfigError(
        fmt::format("run {}: runs inside one process; end that with Ctrl-C", spec.run_id()));
  }
  Line line(spec);
  if (!reset) {
    const auto stops = [](const bridge_status_t& status) {
      return status.state >= bridge_status_t::STATE_STOPPING;
    };
    if (line.SendUntil(true, false, kPatience, stops)) {
      fmt::print("run {}: the bridge has stopped the robot\n", spec.run_id());
      return kExitOk;
    }
    fmt::print(stderr,
               "poise: run {}: the stop was sent, but no bridge has confirmed it for {} s; "
               "has the run ended, or does its reference still run?\n",
               spec.run_id(), kPatience / kSecond);
    return kExitFailed;
  }
  // The edge: low for a while, then high.
  line.SendUntil(false, false, kLow, [](const bridge_status_t&) { return false; });
  const int64_t resets = line.status() ? line.status()->resets : 0;
  if (line.SendUntil(false, true, kPatience,
                     [&](const bridge_status_t& status) { return status.resets > resets; })) {
    fmt::print("run {}: the stop is reset; the bridge follows commands again\n", spec.run_id());
    return kExitOk;
  }
  const std::string problem =
      !line.status() ? "no bridge has answered; has the run ended?"
      : line.status()->state < bridge_status_t::STATE_STOPPING
          ? "there is no stop to reset"
          : "the bridge keeps its stop; it resets only when its motors are at rest and no torque "
            "is commanded";
  fmt::print(stderr, "poise: run {}: {}\n", spec.run_id(), problem);
  return kExitFailed;
}

}  // namespace

void AddEstopCommand(CLI::App* app, Command* command) {
  auto run = std::make_shared<std::string>();
  auto reset = std::make_shared<bool>(false);
  CLI::App* estop = app->add_subcommand("estop", "emergency stop of a run (latched)");
  estop->add_option("run", *run, "folder of the run; default: the latest");
  estop->add_flag("--reset", *reset,
                  "end a stop: only once the motors are at rest and no torque is commanded");
  estop->callback(
      [run, reset, command] { *command = [run, reset] { return Estop(*run, *reset); }; });
}

}  // namespace poise
