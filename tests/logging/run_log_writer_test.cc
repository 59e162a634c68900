#include "logging/run_log_writer.h"

#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <algorithm>

#include "logging/log_cut.h"
#include "logging/log_reader.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/health_t.hpp"
#include "tests/logging/log_test_support.h"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

struct Seen {
  std::string channel;
  int64_t utime;
  std::vector<uint8_t> data;
  bool operator==(const Seen&) const = default;
};

/// With liblcm's reader, which shares no code with ours.
std::vector<Seen> ReadWithLiblcm(const std::string& path) {
  std::vector<Seen> events;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  int64_t number = 0;
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    EXPECT_EQ(event->eventnum, number++);
    const auto* data = static_cast<const uint8_t*>(event->data);
    events.push_back({std::string(event->channel, static_cast<size_t>(event->channellen)),
                      event->timestamp,
                      {data, data + event->datalen}});
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  return events;
}

class RunLogWriterTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  RunSpec spec_ = SmallSpec();
  run_info_t info_ = MakeRunInfo(spec_, "name: \"x\"");
  std::string path_ = folder_.path("run.lcm");
};

TEST_F(RunLogWriterTest, LiblcmReadsEveryEventInTheGraphsOrder) {
  RunLogWriter writer(path_, spec_, info_);
  std::vector<Seen> expected = {{"RUN_INFO", 0, Encode(info_)}};
  for (int64_t tick = 0; tick < 5; ++tick) {
    // COMMAND first, though the graph names it second.
    writer.AddMessage(1, tick, Command(tick));
    writer.AddMessage(0, tick, Push(tick));
    expected.push_back({"PUSH", tick * 2000, Push(tick)});
    expected.push_back({"COMMAND", tick * 2000, Command(tick)});
  }
  writer.Close();
  EXPECT_EQ(writer.missing(), 0);
  EXPECT_EQ(writer.complete_ticks(), 5);
  EXPECT_EQ(ReadWithLiblcm(path_), expected);
}

TEST_F(RunLogWriterTest, FileDoesNotDependOnWhichChannelRunsAhead) {
  constexpr int64_t kTicks = 100;  // beyond the first capacity
  const std::string other = folder_.path("other.lcm");
  {
    RunLogWriter writer(path_, spec_, info_);
    for (int64_t t = 0; t < kTicks; ++t) {
      writer.AddMessage(0, t, Push(t));
      writer.AddMessage(1, t, Command(t));
    }
    writer.Close();
  }
  {
    RunLogWriter writer(other, spec_, info_);
    for (int64_t t = 0; t < kTicks; ++t) writer.AddMessage(1, t, Command(t));
    EXPECT_EQ(writer.complete_ticks(), 0);
    for (int64_t t = 0; t < kTicks; ++t) writer.AddMessage(0, t, Push(t));
    writer.Close();
  }
  EXPECT_EQ(ReadBytes(path_), ReadBytes(other));
}

TEST_F(RunLogWriterTest, IncompleteTicksAreWrittenAndCounted) {
  RunLogWriter writer(path_, spec_, info_);
  for (int64_t t = 0; t < 3; ++t) writer.AddMessage(0, t, Push(t));
  writer.AddMessage(1, 0, Command(0));
  writer.Close();
  EXPECT_EQ(writer.complete_ticks(), 1);
  EXPECT_EQ(writer.missing(), 2);
  EXPECT_EQ(ReadWithLiblcm(path_).size(), 1u + 2u + 2u);
}

TEST_F(RunLogWriterTest, GapsAndRepetitionsAreRefused) {
  RunLogWriter writer(path_, spec_, info_);
  writer.AddMessage(0, 0, Push(0));
  EXPECT_THROW(writer.AddMessage(0, 0, Push(0)), std::logic_error);
  EXPECT_THROW(writer.AddMessage(0, 2, Push(2)), std::logic_error);
  EXPECT_THROW(writer.AddMessage(1, 0, Push(0)), std::logic_error);  // wrong size
}

TEST_F(RunLogWriterTest, HealthAndExternalMessagesStandWhereTheyCame) {
  health_t health{};
  SetHeader(7, &health);
  health.component = "redistributor";
  emergency_stop_t stop{};  // its sender knows no tick: utime 0
  stop.run_id = 42;
  RunLogWriter writer(path_, spec_, info_);
  writer.AddHealth("HEALTH_REDISTRIBUTOR", Encode(health));
  writer.AddMessage(2, 0, Encode(stop));
  writer.AddMessage(0, 0, Push(0));
  writer.AddMessage(1, 0, Command(0));
  writer.AddMessage(0, 1, Push(1));
  writer.AddMessage(1, 1, Command(1));
  writer.AddMessage(0, 2, Push(2));
  writer.AddMessage(2, 0, Encode(stop));  // COMMAND of tick 2 is still to come
  writer.AddMessage(1, 2, Command(2));
  writer.Close();
  const std::vector<Seen> expected = {
      {"RUN_INFO", 0, Encode(info_)}, {"HEALTH_REDISTRIBUTOR", 14000, Encode(health)},
      {"STOP", 0, Encode(stop)},      {"PUSH", 0, Push(0)},
      {"COMMAND", 0, Command(0)},     {"PUSH", 2000, Push(1)},
      {"COMMAND", 2000, Command(1)},  {"STOP", 4000, Encode(stop)},
      {"PUSH", 4000, Push(2)},        {"COMMAND", 4000, Command(2)}};
  EXPECT_EQ(ReadWithLiblcm(path_), expected);
}

TEST_F(RunLogWriterTest, ExternalMessageAfterTheLastTickHasItsTime) {
  spec_.set_num_ticks(2);
  emergency_stop_t stop{};
  RunLogWriter writer(path_, spec_, info_);
  for (int64_t t = 0; t < 2; ++t) {
    writer.AddMessage(0, t, Push(t));
    writer.AddMessage(1, t, Command(t));
  }
  writer.AddMessage(2, 0, Encode(stop));
  writer.Close();
  EXPECT_EQ(ReadWithLiblcm(path_).back(), (Seen{"STOP", 2000, Encode(stop)}));
}

TEST_F(RunLogWriterTest, ExternalMessageIsInTheCutOfItsTicks) {
  emergency_stop_t stop{};
  stop.run_id = 42;
  {
    RunLogWriter writer(path_, spec_, info_);
    for (int64_t t = 0; t < 10; ++t) {
      if (t == 6) writer.AddMessage(2, 0, Encode(stop));
      writer.AddMessage(0, t, Push(t));
      writer.AddMessage(1, t, Command(t));
    }
    writer.Close();
  }
  const auto stops = [&](int64_t first, int64_t last, const std::string& to) {
    CutLog(path_, {first, last, {}}, to);
    const std::vector<Seen> events = ReadWithLiblcm(to);
    return std::count_if(events.begin(), events.end(),
                         [](const Seen& event) { return event.channel == "STOP"; });
  };
  EXPECT_EQ(stops(5, 7, folder_.path("around")), 1);
  EXPECT_EQ(stops(6, 6, folder_.path("at")), 1);
  EXPECT_EQ(stops(0, 5, folder_.path("before")), 0);
  EXPECT_EQ(stops(7, 9, folder_.path("after")), 0);
}

TEST_F(RunLogWriterTest, FlushedEventsAreInTheFileBeforeItIsClosed) {
  RunLogWriter writer(path_, spec_, info_);
  writer.AddMessage(0, 0, Push(0));
  writer.AddMessage(1, 0, Command(0));
  writer.Flush();
  EXPECT_EQ(ReadWithLiblcm(path_).size(), 3u);
}

TEST_F(RunLogWriterTest, UnwritableFileIsNamed) {
  const std::string path = folder_.path("missing") + "/run.lcm";
  try {
    RunLogWriter writer(path, spec_, info_);
    FAIL();
  } catch (const LogError& error) {
    EXPECT_EQ(std::string(error.what()).find(path), 0u) << error.what();
  }
}

TEST_F(RunLogWriterTest, FullDiskIsAnErrorNotSilence) {
  EXPECT_THROW(RunLogWriter("/dev/full", spec_, info_), LogError);
}

}  // namespace
}  // namespace poise::logging
