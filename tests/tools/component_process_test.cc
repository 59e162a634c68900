// A process of a real-time graph dies; another takes its place with its state.
#include "tools/run/component_process.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/bus/control_client.h"
#include "components/framework/clock.h"
#include "components/framework/graph.h"
#include "components/framework/run.h"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"
#include "tests/framework/toy_components.h"
#include "tests/logging/log_test_support.h"

namespace poise {
namespace {

constexpr int64_t kTicks = 500;
constexpr int64_t kSecond = 1'000'000'000;

RunSpec Toys() {
  Graph graph = ToyLoop();
  for (ComponentInstance& instance : *graph.mutable_component()) {
    if (instance.name() == "plant") instance.set_plant(true);
    if (instance.name() == "controller") instance.set_owns_clock(true);
    if (instance.name() == "filter") instance.set_restart(true);
  }
  RunSpec spec = ToyRun(graph, kTicks);
  spec.set_realtime(true);
  spec.set_tick_period(0.002);
  spec.mutable_realtime_options()->set_priority(0);
  ComponentRegistry registry;
  AddToyComponents(&registry);
  FillCounts(BoundGraph(spec, registry).plan(), spec.mutable_graph());
  return spec;
}

template <class T>
T Decode(std::span<const uint8_t> data) {
  T message;
  EXPECT_EQ(message.decode(data.data(), 0, static_cast<int>(data.size())), std::ssize(data));
  return message;
}

TEST(ComponentProcess, ASuccessorGoesOnWithTheStateOfTheOneThatDied) {
  const RunSpec spec = Toys();
  logging::TemporaryFolder folder;
  const std::string run = folder.path("run.pbtxt");
  std::string text;
  google::protobuf::TextFormat::PrintToString(spec, &text);
  std::ofstream(run) << text;

  std::map<int64_t, robot_sensors_t> sensors;
  std::map<int64_t, robot_state_t> states;
  ChannelCollector::Callbacks callbacks;
  callbacks.message = [&](int channel, int64_t tick, std::span<const uint8_t> data) {
    if (channel == 0) sensors[tick] = Decode<robot_sensors_t>(data);
    if (channel == 1) states[tick] = Decode<robot_state_t>(data);
  };
  ChannelCollector collector(spec, "recorder", callbacks);
  ControlClient control(spec);
  std::map<std::string, std::unique_ptr<ComponentProcess>> processes;
  for (const ComponentInstance& instance : spec.graph().component()) {
    processes[instance.name()] = std::make_unique<ComponentProcess>(
        instance.name(),
        std::vector<std::string>{TOY_PROCESS, TypeOf(instance), "--run", run, "--component",
                                 instance.name()},
        folder.path(instance.name() + ".log"), instance.restart());
  }
  ComponentProcess& filter = *processes.at("filter");
  const pid_t first = filter.process().pid();
  const int64_t deadline = NowNanoseconds() + 60 * kSecond;
  int64_t killed_after = -1;
  while (!collector.complete() && NowNanoseconds() < deadline) {
    if (!control.AllReached(health_t::STATE_RUNNING)) control.SendStart();
    collector.Spin(2);
    control.Spin(0);
    for (const auto& [name, process] : processes) {
      ASSERT_TRUE(process->Alive(NowNanoseconds()))
          << name << " " << process->process().HowItEnded() << ": "
          << testing::PrintToString(LastLines(process->process().log_path(), 3));
    }
    if (killed_after < 0 && states.size() >= 100) {
      killed_after = states.rbegin()->first;
      filter.process().Signal(SIGKILL);
    }
  }
  ASSERT_TRUE(collector.complete());
  EXPECT_EQ(filter.takeovers(), 1);
  EXPECT_NE(filter.process().pid(), first);
  EXPECT_EQ(control.statuses().at("filter").health.restarts, 1);
  ASSERT_GT(states.rbegin()->first, killed_after + 10);

  // state(t) = state(before t) / 2 + sensors(t) / 2, over the change of processes too.
  for (auto state = std::next(states.begin()); state != states.end(); ++state) {
    for (size_t i = 0; i < state->second.joint_position.size(); ++i) {
      EXPECT_EQ(state->second.joint_position[i],
                0.5 * std::prev(state)->second.joint_position[i] +
                    0.5 * sensors.at(state->first).joint_position[i])
          << "tick " << state->first;
    }
  }
  for (const auto& [name, process] : processes) process->StopRestarts();
  while (NowNanoseconds() < deadline) {
    control.SendStop();
    control.Spin(5);
    bool ended = true;
    for (const auto& [name, process] : processes) ended = ended && process->process().ended();
    if (ended) break;
  }
  for (const auto& [name, process] : processes) {
    EXPECT_TRUE(process->process().ended() && process->process().succeeded()) << name;
  }
}

TEST(ComponentProcess, OneThatDiesAgainAndAgainHasEnded) {
  logging::TemporaryFolder folder;
  ComponentProcess process("none", {"/bin/false"}, folder.path("none.log"), true);
  const int64_t deadline = NowNanoseconds() + 30 * kSecond;
  while (process.Alive(NowNanoseconds()) && NowNanoseconds() < deadline) {
  }
  EXPECT_LT(NowNanoseconds(), deadline);
}

}  // namespace
}  // namespace poise
