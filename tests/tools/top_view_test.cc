#include "tools/live/top_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "fmt/format.h"
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
  std::string Text(int width = 200) const {
    return PlainText(TopView(spec, names, "runs/a", snapshot, 3), width);
  }
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
  EXPECT_THAT(Text(),
              HasSubstr("tick 1521 of 5000  3.042 s of 10 s\n250.0 ticks/s  0.50 x real time"));
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
  EXPECT_EQ(TopView(spec, names, "", snapshot, 0)[2].style, ViewLine::Style::kFailure);
}

TEST_F(TopViewTest, ShowsAProcess) {
  EXPECT_THAT(Row("PROCESS"), ElementsAre("PROCESS", "STATE", "TICKS/S", "P99", "us", "LATE",
                                          "GAPS", "REFUSED", "DROPPED", "RESENT", "UNSENT", "AGE",
                                          "s", "TICK", "MEDIAN", "us", "MAX", "us"));
  EXPECT_THAT(Row("sim"), ::testing::ElementsAre("sim", "running", "499.8", "565", "7", "11", "22",
                                                 "33", "44", "55", "0.1", "1520", "256", "1278"));
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
              ::testing::ElementsAre("ROBOT_STATE", "500.0", "0.00", "6", "236.0", "kB/s", "472",
                                     "1521", "robot_state_t"));
}

TEST_F(TopViewTest, WhatATerminalIsTooNarrowForComesBelow) {
  snapshot.processes[0].name = "contact_wrench_monitor";
  snapshot.processes[0].health.ticks_skipped = 12;
  snapshot.processes.emplace_back().name = "recorder";
  const std::string text = Text(80);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
  EXPECT_THAT(text, HasSubstr("\nPROCESS                UNSENT AGE s   TICK MEDIAN us MAX us\n"
                              "contact_wrench_monitor     55   0.1   1520       256   1278\n"));
  std::vector<std::string> cells;
  for (const std::string& all : {text, Text()}) {
    std::istringstream in(all);
    const std::set<std::string> words{std::istream_iterator<std::string>(in), {}};
    cells.push_back(fmt::format("{}", fmt::join(words, " ")));
  }
  EXPECT_EQ(cells[0], cells[1]);
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

TEST_F(TopViewTest, TellsTheLead) {
  spec.set_lead_ticks(1000);
  EXPECT_THAT(Text(), HasSubstr("tick 1521 of 5000  1.042 s of 8 s, after 2 s of lead\n"));
}

std::string FrameAt(const std::vector<ViewLine>& lines, int columns, int rows, ViewScroll scroll) {
  return Shown(Frame(lines, columns, rows, &scroll));
}

TEST(FrameTest, KeepsHeaderAndKeysAndScrollsTheRest) {
  std::vector<ViewLine> lines = {{"head 1"}, {"head 2"}, {"head 3"}, {"head 4"}, {""}};
  for (const char c : std::string("abcdef")) {
    lines.push_back({fmt::format("{}:   0123456789", c), ViewLine::Style::kPlain, {4}});
  }
  const std::string head = "head 1\r\nhead 2\r\nhead 3\r\nhead 4\r\n";
  EXPECT_THAT(FrameAt(lines, 80, 24, {}), ::testing::StartsWith(head + "\r\na:   0123456789\r\n"));
  EXPECT_THAT(FrameAt(lines, 80, 24, {}), ::testing::EndsWith("f:   0123456789\r\nq quit"));
  EXPECT_EQ(FrameAt(lines, 80, 8, {}),
            head +
                "a:   0123456789\r\nb:   0123456789\r\nc:   0123456789\r\n"
                "q quit  arrows, space: lines 1-3 of 6");
  EXPECT_EQ(FrameAt(lines, 80, 6, {.line = 2, .column = 0}),
            head + "c:   0123456789\r\nq quit  arrows, space: lines 3-3 of 6");
  // The first column stays, and nobody scrolls beyond the end.
  EXPECT_THAT(FrameAt(lines, 10, 7, {.line = 99, .column = 3}),
              HasSubstr("e:   34567\r\nf:   34567\r\n"));
  EXPECT_THAT(FrameAt(lines, 10, 7, {.line = -1, .column = 99}), HasSubstr("a:   56789\r\n"));
  EXPECT_EQ(FrameAt(lines, 4, 1, {}), "q qu");
  EXPECT_EQ(FrameAt(lines, 0, 0, {}), "q");
}

TEST(FrameTest, AUsualTerminalShowsWhatTellsOfAFault) {
  const RunSpec spec = logging::MakeTestSpec();
  LiveSnapshot snapshot;
  snapshot.processes.push_back({"contact_wrench_monitor", true, {}, 500, 0.1});
  snapshot.channels.emplace_back().name = "CONTACT_WRENCH_MONITOR";
  const auto names = logging::ElementNames::OfSpec(spec);
  const std::string shown = FrameAt(TopView(spec, names, "", snapshot, 0), 80, 24, {});
  for (const char* column : {"P99 us", "LATE", "GAPS", "REFUSED", "DROPPED", "MSG/S", "MISSED"}) {
    EXPECT_THAT(shown, HasSubstr(column));
  }
}

TEST(ViewScrollTest, GoesByKeys) {
  ViewScroll scroll;
  for (const char key : {'j', 'j', 'f', 'k', 'l', 'x'}) scroll.Move(key, 10);
  EXPECT_EQ(scroll.line, 11);
  EXPECT_EQ(scroll.column, 8);
  for (const char key : {'b', 'h'}) scroll.Move(key, 10);
  EXPECT_EQ(scroll.line, 1);
  EXPECT_EQ(scroll.column, 0);
}

}  // namespace
}  // namespace poise
