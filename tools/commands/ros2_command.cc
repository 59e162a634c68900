#include <chrono>
#include <cstdio>
#include <thread>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/live/live_start.h"
#include "tools/live/run_status.h"
#include "tools/ros2/ros2_publisher.h"
#include "tools/run/live_run.h"

namespace poise {
namespace {

// The pause between two looks at the bus: too short for its buffer to fill, and few wake-ups beside
// the run.
constexpr std::chrono::milliseconds kRos2Pause{4};
constexpr std::chrono::milliseconds kRos2Silence{500};  // then it is asked whether the run goes on
constexpr std::chrono::milliseconds kRos2Patience{60'000};  // until the run has begun

struct Ros2Options {
  std::string run;
  uint32_t domain = 0;
  std::string interface = "lo";
  double rate = 100;  // Hz
};

void PublishEvents(RunStatus* status, size_t* told, Ros2Publisher* publisher) {
  const std::optional<nlohmann::ordered_json> newest = status->Take();
  if (!newest || !newest->contains("events")) return;
  const auto& events = (*newest)["events"];
  for (; *told < events.size(); ++*told) {
    const auto& event = events[*told];
    publisher->AddEvent(event["time"], event["name"], event["detail"]);
  }
}

int Ros2(const Ros2Options& options) {
  CatchStopSignals();
  StandBack();
  unitree::DdsLink link;
  link.set_domain(options.domain);
  link.set_interface(options.interface);
  CheckFields(link, "--");
  LiveRun live(options.run, "poise log export --mcap", "poise ros2");
  const logging::RunRecord record = ReadStart(live, kRos2Patience);
  Ros2Publisher publisher(link, record, options.rate);
  RunStatus status((live.dir() / "run.lcm").string(), ReadScenario(live, record));
  fmt::print("{}: DDS domain {} on {}, topics rt/joint_states, rt/odom, rt/tf, ...\n",
             live.dir().string(), options.domain, options.interface);
  std::fflush(stdout);
  size_t told = 0;
  auto last_message = std::chrono::steady_clock::now();
  const auto listen = [&] {
    live.Spin(0, [&](const LiveMessage& message) {
      last_message = std::chrono::steady_clock::now();
      if (message.index >= 0) publisher.Add(message.channel, *message.type, message.data);
    });
  };
  while (StopSignal() == 0) {
    std::this_thread::sleep_for(kRos2Pause);
    listen();
    PublishEvents(&status, &told, &publisher);
    const auto now = std::chrono::steady_clock::now();
    if (now < last_message + kRos2Silence) continue;
    last_message = now;
    if (!live.InProgress()) break;
  }
  listen();
  publisher.Finish();
  fmt::print("{} messages published, {} not taken by DDS\n", publisher.written(),
             publisher.failed());
  return publisher.failed() == 0 ? kExitOk : kExitFailed;
}

}  // namespace

void AddRos2Command(CLI::App* app, Command* command) {
  const auto [ros2, options] = AddCommand<Ros2Options>(
      app, command, "ros2",
      "a run in progress as ROS 2's standard topics over DDS; it only listens to the run", Ros2);
  ros2->add_option("run", options->run,
                   "folder or name of the run; default: the only one that goes on");
  ros2->add_option("--domain", options->domain, "DDS domain")
      ->envname("ROS_DOMAIN_ID")
      ->capture_default_str();
  ros2->add_option("--interface", options->interface,
                   "network interface, e.g. eth0; lo: this machine alone")
      ->capture_default_str();
  ros2->add_option("--rate", options->rate, "Hz; at most the ticks'")
      ->check(Within("in (0, 10000]", [](double hz) { return hz > 0 && hz <= 10'000; }))
      ->capture_default_str();
  SetExample(ros2, "poise ros2 --rate 50");
}

}  // namespace poise
