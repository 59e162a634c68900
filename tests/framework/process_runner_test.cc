// Components as real processes over UDP, against the same components inside one process.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "components/framework/bus/channel_collector.h"
#include "components/framework/configuration/configuration.h"
#include "tests/framework/process_harness.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kTicks = 1500;

TEST(ProcessRunner, GivesTheBytesOfTheInlineRunner) {
  const RunSpec spec = ToyRun(ToyLoop(), kTicks);
  const ProcessRun run = RunAsProcesses(spec);
  ExpectEqualToInline(spec, run, kTicks);
  for (const auto& [name, health] : run.health) {
    EXPECT_EQ(health.messages_refused, 0) << name;
    EXPECT_EQ(health.messages_dropped, 0) << name;
    EXPECT_EQ(health.publish_errors, 0) << name;
    EXPECT_EQ(health.ticks_completed, kTicks) << name;
    EXPECT_GT(health.latency_median, 0) << name;
    EXPECT_GE(health.latency_p99, health.latency_median) << name;
    EXPECT_GE(health.latency_max, health.latency_p99) << name;
  }
  EXPECT_GE(run.health.at("filter").messages_received, kTicks);
}

TEST(ProcessRunner, StaysEqualWhenMessagesAreLost) {
  for (const double rate : {0.05, 0.2}) {
    RunSpec spec = ToyRun(ToyLoop(), 400);
    spec.set_drop_rate(rate);
    const ProcessRun run = RunAsProcesses(spec);
    ExpectEqualToInline(spec, run, 400);
    int64_t dropped = 0;
    int64_t gaps = 0;
    int64_t resends = 0;
    for (const auto& [name, health] : run.health) {
      dropped += health.messages_dropped;
      gaps += health.gaps;
      resends += health.resends;
    }
    // Four channels are heard by components other than their writer's; the resent messages are at
    // risk too.
    EXPECT_GT(static_cast<double>(dropped), 0.5 * rate * 400 * 4);
    EXPECT_GT(gaps, 0);
    EXPECT_GE(resends, dropped / 2);
  }
}

TEST(ProcessRunner, TheOrderOfStartingDoesNotMatter) {
  const RunSpec spec = ToyRun(ToyLoop(), 300);
  ExpectEqualToInline(spec, RunAsProcesses(spec, {.reverse = true}), 300);
}

TEST(ProcessRunner, ALateJoinerCatchesUp) {
  // The plant, then the controller, long after the others were told to start.
  const RunSpec spec = ToyRun(ToyLoop(), 300);
  ExpectEqualToInline(spec, RunAsProcesses(spec, {.late_after_ms = 400}), 300);
  ExpectEqualToInline(spec, RunAsProcesses(spec, {.reverse = true, .late_after_ms = 400}), 300);
}

TEST(ProcessRunner, AFastSourceWaitsForASinkThatDoesNotLeadBack) {
  RunSpec spec = ToyRun(ToyChain(), 3000);
  Configure(&spec, "sink", "work: 2000");
  ExpectEqualToInline(spec, RunAsProcesses(spec), 3000);
  ExpectEqualToInline(spec, RunAsProcesses(spec, {.late_after_ms = 300}), 3000);
}

TEST(ProcessRunner, ATickDoesNotAllocate) {
  RunSpec spec = ToyRun(ToyLoop(), 0);
  spec.set_drop_rate(0.02);  // requests and answers included
  for (const char* name : {"plant", "filter", "controller"})
    Configure(&spec, name, "finish_at: 600 report_allocations: true");
  const ProcessRun run = RunAsProcesses(spec);
  ASSERT_FALSE(run.timed_out);
  for (const auto& [name, health] : run.health) EXPECT_EQ(health.detail, "allocations: 0") << name;
}

TEST(ProcessRunner, EndsWhenAComponentFinishesOrFails) {
  for (const bool fail : {false, true}) {
    RunSpec spec = ToyRun(ToyLoop(), 0);
    Configure(&spec, "plant", fail ? "finish_at: 123 fail: true" : "finish_at: 123");
    const ProcessRun run = RunAsProcesses(spec);
    ExpectEqualToInline(spec, run, 124);
    EXPECT_EQ(run.health.at("plant").state,
              fail ? health_t::STATE_FAILED : health_t::STATE_FINISHED);
    EXPECT_EQ(run.health.at("plant").detail, "toy finished");
    EXPECT_EQ(run.health.at("plant").tick, 123);
  }
}

TEST(ProcessRunner, ANumberThatIsNotFiniteEndsTheRunAndIsNamed) {
  RunSpec spec = ToyRun(ToyLoop(), 0);
  Configure(&spec, "filter", "");
  Configure(&spec, "plant", "nan_at: 50");
  const ProcessRun run = RunAsProcesses(spec);
  ASSERT_FALSE(run.timed_out);
  EXPECT_EQ(run.health.at("plant").state, health_t::STATE_FAILED);
  EXPECT_EQ(run.health.at("plant").detail, "output sensors is not finite at tick 50");
  EXPECT_EQ(run.exit_codes.at("plant"), 1);
  EXPECT_EQ(run.exit_codes.at("filter"), 0);
}

TEST(ProcessRunner, SigtermEndsCleanlyAtAnyTime) {
  const RunSpec spec = ToyRun(ToyLoop(), 0);
  HarnessOptions options;
  int calls = 0;
  options.end = [&](const std::map<std::string, pid_t>&) { return ++calls == 20; };
  const ProcessRun run = RunAsProcesses(spec, options);
  ASSERT_FALSE(run.timed_out);
  ASSERT_EQ(run.exit_codes.size(), 3u);
  for (const auto& [name, code] : run.exit_codes) EXPECT_EQ(code, 0) << name;
}

TEST(ProcessRunner, RealTimeGivesTheSameBytes) {
  RunSpec spec = ToyRun(ToyLoop(), 250);
  spec.set_realtime(true);
  ExpectEqualToInline(spec, RunAsProcesses(spec), 250);
}

TEST(ChannelCollector, NeedsTheCountsOfTheCheckedGraph) {
  try {
    const RunSpec spec = ToyRun(ToyLoop(), 1);
    const RunSource source(spec);
    ChannelCollector collector(spec, source.socket(), "recorder", {nullptr, nullptr});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "channel SENSORS: the run gives 0 counts, robot_sensors_t has 2; fill them in "
                 "from the checked graph");
  }
}

TEST(ComponentMain, RefusesWrongUsageInOneLine) {
  const auto expect = [](const std::vector<std::string>& arguments, int code,
                         const std::string& text) {
    std::vector<std::string> all = {TOY_PROCESS, "toy_filter"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const auto [exit_code, error] = RunProgram(all);
    EXPECT_EQ(exit_code, code) << error;
    EXPECT_THAT(error, HasSubstr(text));
    EXPECT_LE(std::count(error.begin(), error.end(), '\n'), 1) << error;
  };
  expect({}, 2, "--run is required; see toy_filter --help");
  expect({"--speed", "3"}, 2, "toy_filter: ");
  expect({"--run", "/no/such/file"}, 2,
         "toy_filter: /no/such/file: cannot be read: No such file or directory");
  const std::string path =
      testing::TempDir() + "/wrong_type_" + std::to_string(getpid()) + ".pbtxt";
  std::string text;
  google::protobuf::TextFormat::PrintToString(ToyRun(ToyLoop(), 1), &text);
  std::ofstream(path) << text;
  expect({"--run", path, "--component", "plant"}, 2,
         "plant: component plant is of type toy_plant; this program is toy_filter");
  unlink(path.c_str());
  expect({"--help"}, 0, "");
  expect({"--version"}, 0, "");
}

}  // namespace
}  // namespace poise
