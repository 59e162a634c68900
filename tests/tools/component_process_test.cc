// A process of a real-time graph dies; another takes its place with its state.
#include "tools/run/component_process.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>
#include <thread>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/bus/control_client.h"
#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/graph.h"
#include "components/framework/run.h"
#include "poise/external_push_t.hpp"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"
#include "tests/framework/toy_components.h"
#include "tests/logging/log_test_support.h"
#include "tools/cli/stall_watch.h"

namespace poise {
namespace {

constexpr int64_t kTicks = 500;
constexpr int64_t kSecond = 1'000'000'000;

/// The loop; `shared`: a second component shares the filter's process.
RunSpec Toys(bool shared) {
  Graph graph = ToyLoop();
  if (shared) {
    Channel* const sum = graph.add_channel();
    sum->set_name("SUM");
    sum->set_type("external_push_t");
    ComponentInstance* const sink = graph.add_component();
    ParseTextProto(R"(name: "sink" type: "toy_sink" restart: true process: "host"
                      input { port: "push" channel: "PUSH" }
                      output { port: "sum" channel: "SUM" })",
                   "sink", sink);
    graph.mutable_component(1)->set_process("host");
  }
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
  FillPlan(BoundGraph(spec, registry).plan(), spec.mutable_graph());
  return spec;
}

template <class T>
T Decode(std::span<const uint8_t> data) {
  T message;
  EXPECT_EQ(message.decode(data.data(), 0, static_cast<int>(data.size())), std::ssize(data));
  return message;
}

class Takeover : public testing::TestWithParam<bool> {};

TEST_P(Takeover, ASuccessorGoesOnWithTheStateOfTheOneThatDied) {
  const bool shared = GetParam();
  const RunSpec spec = Toys(shared);
  logging::TemporaryFolder folder;
  const std::string run = folder.path("run.pbtxt");
  std::string text;
  google::protobuf::TextFormat::PrintToString(spec, &text);
  std::ofstream(run) << text;

  std::map<int64_t, robot_sensors_t> sensors;
  std::map<int64_t, robot_state_t> states;
  std::map<int64_t, external_push_t> pushes, sums;
  ChannelCollector::Callbacks callbacks;
  callbacks.message = [&](int channel, int64_t tick, std::span<const uint8_t> data) {
    if (channel == 0) sensors[tick] = Decode<robot_sensors_t>(data);
    if (channel == 1) states[tick] = Decode<robot_state_t>(data);
    if (channel == 4) pushes[tick] = Decode<external_push_t>(data);
    if (channel == 6) sums[tick] = Decode<external_push_t>(data);
  };
  const RunSource source(spec);
  ChannelCollector collector(spec, source.socket(), "recorder", callbacks);
  ControlClient control(spec, &source.socket());
  std::map<std::string, std::unique_ptr<ComponentProcess>> processes;
  for (const std::string& process : ProcessNames(spec.graph())) {
    const std::vector<int> members = ComponentsOf(spec.graph(), process);
    const ComponentInstance& first = spec.graph().component(members.front());
    std::vector<std::string> command = {TOY_PROCESS, TypeOf(first), "--run",
                                        run,         "--component", first.name()};
    if (members.size() > 1) command = {TOY_PROCESS, "host", "--run", run, "--process", process};
    processes[process] = std::make_unique<ComponentProcess>(
        process, command, folder.path(process + ".log"), first.restart(), source.socket());
  }
  ComponentProcess& filter = *processes.at(shared ? "host" : "filter");
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
      // Between two ticks, which are 2 ms apart: its last state is then kept.
      std::this_thread::sleep_for(std::chrono::microseconds(700));
      filter.process().Signal(SIGKILL);
    }
  }
  ASSERT_TRUE(collector.complete());
  EXPECT_EQ(filter.takeovers(), 1);
  EXPECT_NE(filter.process().pid(), first);
  EXPECT_EQ(control.statuses().at("filter").health.restarts, 1);
  ASSERT_GT(states.rbegin()->first, killed_after + 10);
  if (shared) {
    EXPECT_EQ(control.statuses().at("sink").health.restarts, 1);
  }

  // state(t) = state(before t) / 2 + sensors(t) / 2, over the change of processes too.
  for (auto state = std::next(states.begin()); state != states.end(); ++state) {
    for (size_t i = 0; i < state->second.joint_position.size(); ++i) {
      EXPECT_EQ(state->second.joint_position[i],
                0.5 * std::prev(state)->second.joint_position[i] +
                    0.5 * sensors.at(state->first).joint_position[i])
          << "tick " << state->first;
    }
  }
  // sum(t) = sum(before t) + push(t), likewise.
  EXPECT_EQ(sums.empty(), !shared);
  for (auto sum = sums.begin(); sum != sums.end(); ++sum) {
    const double before = sum == sums.begin() ? 0 : std::prev(sum)->second.force[0];
    EXPECT_EQ(sum->second.force[0], before + pushes.at(sum->first).force[0])
        << "tick " << sum->first;
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

INSTANTIATE_TEST_SUITE_P(ComponentProcess, Takeover, testing::Bool(), [](const auto& shared) {
  return shared.param ? "OfSeveralInOneProcess" : "OfOne";
});

/// Questions every 20 ms for `time`, ns; each adds what `use` makes of the processor's time.
template <class Use>
int64_t Ask(SilenceWatch* watch, int64_t pid, int64_t time, int64_t* now, ProcessorTime* processor,
            const Use& use) {
  constexpr int64_t kLook = 20'000'000;
  int64_t silent = 0;
  for (int64_t asked = 0; asked < time; asked += kLook) {
    *now += kLook;
    use(processor, kLook);
    silent = watch->Silent(pid, /*heard=*/1, *processor, *now);
  }
  return silent;
}

TEST(SilenceWatch, CountsTheTimeInWhichAProcessCouldHaveSpoken) {
  SilenceWatch watch;
  int64_t now = kSecond;
  ProcessorTime processor;
  const auto sleeps = [](ProcessorTime*, int64_t) {};
  const auto computes = [](ProcessorTime* time, int64_t look) {
    time->ready = true;
    time->used += look;
  };
  // As among thirty: it has its turn now and then, and the system tells of a wait when it is over.
  int turn = 0;
  const auto waits = [&](ProcessorTime* time, int64_t look) {
    time->ready = true;
    if (++turn % 15 != 0) return;
    time->used += look / 10;
    time->waited += 15 * look;
  };
  EXPECT_NEAR(static_cast<double>(Ask(&watch, 1, 3 * kSecond, &now, &processor, sleeps)), 3e9, 1e8);
  EXPECT_NEAR(static_cast<double>(Ask(&watch, 1, 3 * kSecond, &now, &processor, computes)), 6e9,
              1e8);
  EXPECT_NEAR(static_cast<double>(Ask(&watch, 1, 60 * kSecond, &now, &processor, waits)), 6e9, 1e8);
  // A successor is not silent for what the one before it was.
  EXPECT_EQ(watch.Silent(2, 1, {}, now), 0);
  // Who asks was halted.
  now += 100 * kSecond;
  EXPECT_LT(watch.Silent(2, 1, {}, now), kSecond);
  EXPECT_EQ(watch.Silent(2, now, {}, now), 0) << "it has spoken";
}

TEST(ChildProcess, TellsWhatItHadOfTheProcessors) {
  logging::TemporaryFolder folder;
  ChildProcess busy("busy", {"/bin/sh", "-c", "while :; do :; done"}, folder.path("busy.log"));
  ChildProcess idle("idle", {"/bin/sleep", "600"}, folder.path("idle.log"));
  const int64_t deadline = NowNanoseconds() + 60 * kSecond;
  const auto until = [&](const auto& holds) {
    while (!holds() && NowNanoseconds() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return holds();
  };
  EXPECT_TRUE(until([&] { return busy.processor_time().used > kSecond / 10; }));
  EXPECT_TRUE(busy.processor_time().ready);
  EXPECT_TRUE(until([&] { return !idle.processor_time().ready; }));
  busy.Signal(SIGSTOP);
  EXPECT_TRUE(until([&] { return !busy.processor_time().ready; })) << "it stands still by itself";
  busy.Signal(SIGKILL);
  EXPECT_TRUE(until([&] { return busy.ended(); }));
  EXPECT_EQ(busy.processor_time().used, 0);
}

TEST(ComponentProcess, OneThatDiesAgainAndAgainHasEnded) {
  logging::TemporaryFolder folder;
  const RunSource source(Toys(false));
  ComponentProcess process("none", {"/bin/false"}, folder.path("none.log"), true, source.socket());
  const int64_t deadline = NowNanoseconds() + 30 * kSecond;
  while (process.Alive(NowNanoseconds()) && NowNanoseconds() < deadline) {
  }
  EXPECT_LT(NowNanoseconds(), deadline);
}

}  // namespace
}  // namespace poise
