#include <poll.h>

#include <memory>

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
constexpr int kRepeat = 20;  // ms

int FindChannel(const Graph& graph, const std::string& type, bool external) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).type() == type && graph.channel(i).external() == external) return i;
  }
  throw ConfigError(fmt::format("graph {}: has no{} channel of type {}", graph.name(),
                                external ? " external" : "", type));
}

/// True when the bridge says that it stops.
bool Stops(const BusReceiver::Packet& packet, int64_t run_id) {
  bridge_status_t status;
  return DecodeChecked(packet.data, static_cast<int64_t>(packet.size), &status) &&
         status.run_id == run_id && status.state >= bridge_status_t::STATE_STOPPING;
}

int Estop(const std::string& run) {
  const RunSpec spec = ReadRunSpec(run);
  if (spec.first_port() == 0) {
    throw ConfigError(
        fmt::format("run {}: runs inside one process; end that with Ctrl-C", spec.run_id()));
  }
  const int channel = FindChannel(spec.graph(), "emergency_stop_t", true);
  BusSender sender(ChannelUrl(spec, channel));
  BusReceiver answers(ChannelUrl(spec, FindChannel(spec.graph(), "bridge_status_t", false)));
  emergency_stop_t stop{};
  stop.run_id = spec.run_id();
  stop.stop = 1;
  std::vector<uint8_t> bytes(static_cast<size_t>(stop.getEncodedSize()));
  stop.encode(bytes.data(), 0, static_cast<int>(bytes.size()));

  const int64_t deadline = NowNanoseconds() + kPatience;
  while (NowNanoseconds() < deadline) {
    if (!sender.Send(spec.graph().channel(channel).name().c_str(), bytes.data(), bytes.size())) {
      throw BusError("the stop could not be sent; is the network up? run: poise doctor");
    }
    pollfd fd{answers.fd(), POLLIN, 0};
    poll(&fd, 1, kRepeat);
    BusReceiver::Packet packet;
    while (answers.Receive(&packet)) {
      if (!Stops(packet, spec.run_id())) continue;
      fmt::print("run {}: the bridge has stopped the robot\n", spec.run_id());
      return kExitOk;
    }
  }
  fmt::print(stderr,
             "poise: run {}: the stop was sent, but no bridge has confirmed it for {} s; "
             "has the run ended, or does its reference still run?\n",
             spec.run_id(), kPatience / kSecond);
  return kExitFailed;
}

}  // namespace

void AddEstopCommand(CLI::App* app, Command* command) {
  auto run = std::make_shared<std::string>();
  CLI::App* estop = app->add_subcommand("estop", "emergency stop of a run (latched)");
  estop->add_option("run", *run, "folder of the run; default: the latest");
  estop->callback([run, command] { *command = [run] { return Estop(*run); }; });
}

}  // namespace poise
