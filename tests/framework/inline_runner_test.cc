#include "components/framework/runners/inline_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/framework/toy.pb.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using ::testing::ElementsAre;

class InlineRunnerTest : public ::testing::Test {
 protected:
  InlineRunnerTest() { AddToyComponents(&registry_); }
  void Configure(const std::string& name, const std::string& text) {
    ComponentConfig* config = spec_.add_config();
    config->set_component(name);
    config->set_text(text);
  }
  std::vector<uint8_t> RunAll() {
    InlineRunner runner(spec_, registry_);
    std::vector<uint8_t> all;
    runner.set_tap([&](int, const OutputPort& output, const Tick&) {
      std::vector<uint8_t> bytes(static_cast<size_t>(output.encoded_size()));
      output.Encode(bytes.data(), static_cast<int>(bytes.size()));
      all.insert(all.end(), bytes.begin(), bytes.end());
    });
    runner.Run(1000);
    return all;
  }
  ComponentRegistry registry_;
  RunSpec spec_ = ToyRun(ToyLoop(), 0);
};

TEST_F(InlineRunnerTest, TapsOutputsInTheOrderOfTheTick) {
  InlineRunner runner(spec_, registry_);
  std::vector<std::string> seen;
  runner.set_tap([&](int channel, const OutputPort& output, const Tick& tick) {
    seen.push_back(std::to_string(tick.index) + " " + output.name() + " " +
                   runner.plan().channels[static_cast<size_t>(channel)].name);
  });
  runner.Step();
  runner.Step();
  EXPECT_THAT(
      seen, ElementsAre("0 sensors SENSORS", "0 push PUSH", "0 torque TORQUE", "0 state STATE",
                        "0 command COMMAND", "1 sensors SENSORS", "1 push PUSH", "1 torque TORQUE",
                        "1 state STATE", "1 command COMMAND"));
}

TEST_F(InlineRunnerTest, MessagesAreStampedAndDelayedInputsShowTheTickBefore) {
  InlineRunner runner(spec_, registry_);
  runner.set_tap([&](int, const OutputPort& output, const Tick& tick) {
    EXPECT_EQ(tick.utime, tick.index * 2000);
    EXPECT_DOUBLE_EQ(tick.time, 0.002 * static_cast<double>(tick.index));
    if (output.name() != "push") return;
    const auto& push = *static_cast<const external_push_t*>(output.message());
    EXPECT_EQ(push.run_id, spec_.run_id());
    EXPECT_EQ(push.tick, tick.index);
    EXPECT_EQ(push.utime, tick.utime);
    // The plant writes the tick of the command that it saw.
    EXPECT_EQ(push.force[1], tick.index == 0 ? 0.0 : static_cast<double>(tick.index - 1));
  });
  EXPECT_EQ(runner.Run(50), 50);
}

TEST_F(InlineRunnerTest, TheSameRunGivesTheSameBytes) {
  const std::vector<uint8_t> first = RunAll();
  EXPECT_EQ(first, RunAll());
  spec_.set_seed(43);
  EXPECT_NE(first, RunAll());
}

TEST_F(InlineRunnerTest, TheOrderOfTheGraphDoesNotMatterForTheNumbers) {
  const auto last_command = [&] {
    InlineRunner runner(spec_, registry_);
    std::vector<double> torque;
    runner.set_tap([&](int, const OutputPort& output, const Tick&) {
      if (output.name() == "command")
        torque = static_cast<const joint_command_t*>(output.message())->torque;
    });
    runner.Run(500);
    return torque;
  };
  const std::vector<double> expected = last_command();
  spec_.mutable_graph()->mutable_component()->SwapElements(0, 2);
  EXPECT_EQ(last_command(), expected);
}

TEST_F(InlineRunnerTest, EndsAfterTheTickInWhichAComponentFinishes) {
  Configure("plant", "finish_at: 7");
  InlineRunner runner(spec_, registry_);
  int64_t commands = 0;
  runner.set_tap(
      [&](int, const OutputPort& output, const Tick&) { commands += output.name() == "command"; });
  EXPECT_EQ(runner.Run(100), 8);
  EXPECT_EQ(commands, 8);  // the controller, last in the tick, still ran
  EXPECT_TRUE(runner.ended());
  EXPECT_FALSE(runner.failed());
  EXPECT_EQ(runner.end_detail(), "plant: toy finished");
  EXPECT_FALSE(runner.Step());
  EXPECT_EQ(runner.ticks_completed(), 8);
}

TEST_F(InlineRunnerTest, TellsAFailureFromAPlannedEnd) {
  Configure("filter", "finish_at: 3 fail: true");
  InlineRunner runner(spec_, registry_);
  runner.Run(100);
  EXPECT_TRUE(runner.failed());
}

TEST_F(InlineRunnerTest, EndsAtThePlannedTickAndOnTheStopFlag) {
  spec_.set_num_ticks(20);
  InlineRunner planned(spec_, registry_);
  EXPECT_EQ(planned.Run(100), 20);
  EXPECT_TRUE(planned.ended());
  std::atomic<bool> stop{false};
  spec_.set_num_ticks(0);
  InlineRunner stopped(spec_, registry_);
  stopped.set_tap([&](int, const OutputPort&, const Tick& tick) { stop = tick.index == 4; });
  EXPECT_EQ(stopped.Run(100, &stop), 5);
  EXPECT_FALSE(stopped.ended());
}

TEST_F(InlineRunnerTest, ANumberThatIsNotFiniteEndsTheRunBeforeAnyoneReadsIt) {
  Configure("plant", "nan_at: 5");
  InlineRunner runner(spec_, registry_);
  int64_t outputs = 0;
  runner.set_tap([&](int, const OutputPort&, const Tick&) { ++outputs; });
  EXPECT_EQ(runner.Run(100), 5);
  EXPECT_TRUE(runner.failed());
  EXPECT_EQ(runner.end_detail(), "plant: output sensors is not finite at tick 5");
  EXPECT_EQ(outputs, 5 * 5);
}

TEST_F(InlineRunnerTest, InjectedMessagesAreShownFromThenOn) {
  InlineRunner runner(spec_, registry_);
  int8_t status = -1;
  runner.set_tap([&](int, const OutputPort& output, const Tick&) {
    if (output.name() == "command")
      status = static_cast<const joint_command_t*>(output.message())->status;
  });
  runner.Step();
  EXPECT_EQ(status, 0);
  emergency_stop_t stop{};
  stop.run_id = spec_.run_id();
  stop.stop = 1;
  std::vector<uint8_t> bytes(static_cast<size_t>(stop.getEncodedSize()));
  stop.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  EXPECT_FALSE(runner.Inject("SENSORS", bytes));
  EXPECT_FALSE(runner.Inject("STOP", std::span(bytes).first(bytes.size() - 1)));
  runner.Step();
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(runner.Inject("STOP", bytes));
  runner.Step();
  EXPECT_EQ(status, 1);
  bytes[8] ^= 1;  // another run
  EXPECT_FALSE(runner.Inject("STOP", bytes));
}

TEST_F(InlineRunnerTest, ATickDoesNotAllocate) {
  Configure("plant", "joints: 12");
  Configure("filter", "joints: 12");
  Configure("controller", "joints: 12");
  InlineRunner runner(spec_, registry_);
  runner.Run(10);
  const int64_t before = AllocationCount();
  runner.Run(1000);
  EXPECT_EQ(AllocationCount() - before, 0);
  EXPECT_EQ(runner.tick_latency().count(), 1010);
  EXPECT_EQ(runner.latency(0).count(), 2 * 1010);  // the controller has two stages
}

}  // namespace
}  // namespace poise
