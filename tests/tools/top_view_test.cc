#include "tools/live/top_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/logging/log_test_support.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class TopViewTest : public ::testing::Test {
 protected:
  TopViewTest() {
    spec.set_num_ticks(5000);
    LiveSnapshot::Process process;
    process.name = "sim";
    process.seen = true;
    process.health.state = health_t::STATE_RUNNING;
    process.health.tick = 1520;
    process.health.latency_median = 256.5;
    process.health.latency_p99 = 565;
    process.health.latency_max = 1278.4;
    process.health.deadline_misses = 7;
    process.health.gaps = 11;
    process.health.messages_refused = 22;
    process.health.messages_dropped = 33;
    process.health.resends = 44;
    process.health.publish_errors = 55;
    process.tick_rate = 499.75;
    process.age = 0.1;
    snapshot.processes.push_back(process);
    LiveSnapshot::ChannelRow channel;
    channel.name = "ROBOT_STATE";
    channel.type = "robot_state_t";
    channel.tick = 1521;
    channel.rate = 500;
    channel.bytes_per_second = 236e3;
    channel.bytes_per_message = 472;
    channel.age = 0.002;
    channel.missed = 6;
    snapshot.channels.push_back(channel);
    snapshot.tick = 1521;
    snapshot.tick_rate = 250;
  }
  std::string Text() const { return PlainText(TopView(spec, names, "runs/a", snapshot, 3)); }
  /// The words of the first line that begins with `name`.
  std::vector<std::string> Row(const std::string& name) const {
    std::istringstream lines(Text());
    std::string line;
    while (std::getline(lines, line) && !line.starts_with(name)) {
    }
    std::istringstream in(line);
    return {std::istream_iterator<std::string>(in), {}};
  }

  RunSpec spec = logging::MakeTestSpec();
  logging::ElementNames names = logging::ElementNames::OfSpec(spec);
  LiveSnapshot snapshot;
};

TEST_F(TopViewTest, ShowsTheRunsProgress) {
  EXPECT_THAT(Text(), HasSubstr("synthetic  run 42  runs/a\n"));
  // 1521 ticks of 2 ms; 250 ticks/s are half of real time.
  EXPECT_THAT(Text(), HasSubstr("tick 1521 of 5000  3.042 s  250.0 ticks/s  0.50 x real time"));
  EXPECT_THAT(Text(), HasSubstr("refused here: 3 packets"));
}

TEST_F(TopViewTest, ShowsEachSlaveOfTheBus) {
  EXPECT_THAT(Text(), Not(HasSubstr("SLAVE")));
  bus_status_t& bus = snapshot.bus.emplace();
  bus.num_slaves = 3;
  bus.online = {1, 1, 0};
  bus.al_status = {8, 0x14, 8};
  bus.al_code = {0, 0x1B, 0};
  bus.error_code = {0, 0x8130, 0};
  bus.emergency = {0, 0x8130, 0};
  bus.emergencies = {0, 2, 0};
  bus.clock_difference = {-7, 12, 0};
  bus.receive_errors = {0, 0, 5};
  bus.lost_links = {0, 0, 1};
  bus.recoveries = {0, 3, 0};
  EXPECT_THAT(Row("0 "), ElementsAre("0", "OP", "0000", "0000", "0", "-7", "0", "0", "0"));
  EXPECT_THAT(Row("1 "), ElementsAre("1", "SAFE-OP,", "error", "001B", "8130", "8130", "2", "12",
                                     "0", "0", "3"));
  EXPECT_THAT(Text(), HasSubstr("2     does not answer"));
}

TEST_F(TopViewTest, ShowsTheBridgesState) {
  EXPECT_THAT(Text(), Not(HasSubstr("bridge:")));
  snapshot.bridge.emplace();
  snapshot.bridge->state = bridge_status_t::STATE_RUNNING;
  snapshot.bridge->reason = bridge_status_t::REASON_NONE;
  snapshot.bridge->reason_joint = -1;
  EXPECT_THAT(Text(), HasSubstr("bridge: running\n"));
  snapshot.bridge->state = bridge_status_t::STATE_STOPPING;
  snapshot.bridge->reason = bridge_status_t::REASON_JOINT_VELOCITY;
  snapshot.bridge->reason_joint = 3;
  EXPECT_THAT(Text(), HasSubstr("bridge: stopping, joint too fast (right_knee_pitch)\n"));
  snapshot.bridge->reason_joint = -1;
  snapshot.bridge->state = bridge_status_t::STATE_ESTOP;
  snapshot.bridge->reason = bridge_status_t::REASON_OPERATOR;
  EXPECT_THAT(Text(), HasSubstr("bridge: emergency stop, operator\n"));
  EXPECT_EQ(TopView(spec, names, "", snapshot, 0)[1].style, ViewLine::Style::kFailure);
}

TEST_F(TopViewTest, ShowsAProcess) {
  EXPECT_THAT(Row("sim"),
              ::testing::ElementsAre("sim", "running", "1520", "499.8", "256.5", "565.0", "1278.4",
                                     "7", "11", "44", "22", "33", "55", "0.1"));
}

TEST_F(TopViewTest, NamesTheProcessThatAComponentShares) {
  ASSERT_EQ(spec.graph().component(0).name(), "sim");
  spec.mutable_graph()->mutable_component(0)->set_process("all");
  EXPECT_EQ(Row("all/sim").at(1), "running");
}

TEST_F(TopViewTest, ShowsRealTimeWhereThereIsAny) {
  EXPECT_THAT(Text(), Not(HasSubstr("skipped")));
  EXPECT_THAT(Text(), Not(HasSubstr("restarted")));
  EXPECT_THAT(Text(), Not(HasSubstr("scheduling")));
  health_t& health = snapshot.processes[0].health;
  health.scheduling = health_t::SCHEDULING_FIFO | health_t::SCHEDULING_MEMORY_LOCKED;
  health.lateness_max = 81.25;
  EXPECT_THAT(Text(), HasSubstr("\n  at most 81.2 us late; scheduling: fifo, locked\n"));
  health.ticks_skipped = 12;
  health.restarts = 2;
  EXPECT_THAT(Text(), HasSubstr("12 ticks skipped; restarted 2 times;"));
}

TEST_F(TopViewTest, ShowsAChannel) {
  EXPECT_THAT(Row("ROBOT_STATE"),
              ::testing::ElementsAre("ROBOT_STATE", "robot_state_t", "1521", "500.0", "236.0",
                                     "kB/s", "472", "0.00", "6"));
}

TEST_F(TopViewTest, MarksWhatIsWrong) {
  using Style = ViewLine::Style;
  const auto style = [&] {
    for (const ViewLine& line : TopView(spec, names, "", snapshot, 0)) {
      if (line.text.starts_with("sim")) return line.style;
    }
    return Style::kTitle;
  };
  EXPECT_EQ(style(), Style::kWarning);  // it missed deadlines
  snapshot.processes[0].health.deadline_misses = 0;
  EXPECT_EQ(style(), Style::kPlain);
  snapshot.processes[0].age = 3;
  EXPECT_EQ(style(), Style::kWarning);
  snapshot.processes[0].health.state = health_t::STATE_FINISHED;  // reports no more
  EXPECT_EQ(style(), Style::kPlain);
  snapshot.processes[0].health.state = health_t::STATE_FAILED;
  EXPECT_EQ(style(), Style::kFailure);
  snapshot.processes[0].seen = false;
  EXPECT_EQ(style(), Style::kWarning);
  EXPECT_THAT(Text(), HasSubstr("not heard of"));
}

TEST_F(TopViewTest, WhatAProcessSaysCannotDriveTheTerminal) {
  snapshot.processes[0].health.detail = "gone\x1b[2J\r\n\x9b";
  EXPECT_THAT(Text(), HasSubstr("gone\\x1b[2J\\x0d\\n\\x9b"));
  EXPECT_THAT(Text(), Not(HasSubstr("\x1b")));
}

/// What a frame shows, without its escape sequences.
std::string Shown(const std::string& frame) {
  std::string shown;
  for (size_t i = 0; i < frame.size(); ++i) {
    if (frame[i] == '\x1b') {
      while (!std::isalpha(static_cast<unsigned char>(frame[i]))) ++i;
    } else {
      shown += frame[i];
    }
  }
  return shown;
}

TEST(FrameTest, CutsWhatDoesNotFit) {
  const std::vector<ViewLine> lines = {
      {"abcdef", ViewLine::Style::kTitle}, {"", ViewLine::Style::kPlain}, {"ghi"}, {"jkl"}};
  EXPECT_EQ(Shown(Frame(lines, 80, 24)), "abcdef\r\n\r\nghi\r\njkl");
  EXPECT_EQ(Shown(Frame(lines, 4, 24)), "abcd\r\n\r\nghi\r\njkl");
  EXPECT_EQ(Shown(Frame(lines, 80, 3)), "abcdef\r\nghi\r\njkl");  // the blank line goes first
  EXPECT_EQ(Shown(Frame(lines, 2, 1)), "ab");
  EXPECT_EQ(Shown(Frame(lines, 0, 0)), "a");
}

}  // namespace
}  // namespace poise
