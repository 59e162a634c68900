#include "logging/log_survey.h"

#include <gtest/gtest.h>

#include <limits>

#include "components/framework/configuration/configuration.h"
#include "logging/log_cut.h"
#include "logging/run_record.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/health_t.hpp"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

constexpr int64_t kLogSurveyTicks = 10;

class LogSurveyTest : public testing::Test {
 protected:
  std::vector<std::string> Problems(const std::vector<RawEvent>& events) {
    WriteRawLog(path_, events);
    survey_ = SurveyLog(path_);
    return survey_.Problems(0);
  }
  /// The one problem that there is.
  std::string Problem(const std::vector<RawEvent>& events) {
    const std::vector<std::string> problems = Problems(events);
    EXPECT_EQ(problems.size(), 1u) << testing::PrintToString(problems);
    return problems.empty() ? "" : problems[0];
  }
  /// Index in SmallLog of the PUSH of `tick`; the COMMAND follows.
  static size_t PushOf(int64_t tick) { return static_cast<size_t>(1 + 2 * tick); }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("log");
  LogSurvey survey_;
};

TEST_F(LogSurveyTest, WholeLog) {
  EXPECT_TRUE(Problems(SmallLog(kLogSurveyTicks)).empty());
  EXPECT_EQ(survey_.end_tick, kLogSurveyTicks);
  EXPECT_EQ(survey_.events, 2 * kLogSurveyTicks + 2);
  ASSERT_EQ(survey_.channels.size(), 3u);
  EXPECT_EQ(survey_.channels[0].ticks.messages, kLogSurveyTicks);
  EXPECT_EQ(survey_.channels[0].bytes, kLogSurveyTicks * static_cast<int64_t>(Push(0).size()));
  ASSERT_EQ(survey_.others.size(), 2u);
  EXPECT_EQ(survey_.others[0].type, "health_t");
}

TEST_F(LogSurveyTest, NamesTheTicksThatAreMissing) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  events.erase(events.begin() + 1 + 2 * 7);  // PUSH 7, 4, 3
  events.erase(events.begin() + 1 + 2 * 4);
  events.erase(events.begin() + 1 + 2 * 3);
  EXPECT_EQ(Problem(events), "PUSH: 3 of its messages missing: tick 3 to 4, 7");
}

TEST_F(LogSurveyTest, CountsDoubleDisorderedAndRefused) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  std::swap(events[PushOf(2)], events[PushOf(3)]);
  EXPECT_EQ(Problem(events), "PUSH: 1 messages out of order");

  events = SmallLog(kLogSurveyTicks);
  events.insert(events.begin() + 5, events[PushOf(1)]);
  EXPECT_EQ(Problem(events), "PUSH: 1 messages of a tick that was there already");

  events = SmallLog(kLogSurveyTicks);
  external_push_t push{};
  SetHeader(2, &push);
  push.point[1] = std::numeric_limits<double>::infinity();
  events.push_back({"PUSH", 0, Encode(push)});
  events[PushOf(2)].data = Encode(push);
  const std::vector<std::string> problems = Problems(events);
  ASSERT_EQ(problems.size(), 2u);
  EXPECT_EQ(problems[0], "PUSH: 1 of its messages missing: tick 2");
  EXPECT_NE(problems[1].find("PUSH: 2 messages are not of its type"), std::string::npos);
  EXPECT_NE(problems[1].find(std::to_string(RecordOffset(events, PushOf(2))) + ", " +
                             std::to_string(RecordOffset(events, events.size() - 1))),
            std::string::npos)
      << problems[1];
}

TEST_F(LogSurveyTest, SaysThatAChannelIsOfAnotherVersion) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  for (int64_t tick = 0; tick < kLogSurveyTicks; ++tick) {
    std::vector<uint8_t>& data = events[PushOf(tick)].data;
    data[0] ^= 0xFF;               // of its fingerprint
    data.resize(data.size() - 8);  // a field less
  }
  EXPECT_EQ(Problem(events),
            "PUSH: all 10 messages are of another version of their type, as a Poise of another "
            "commit wrote them; that one reads them");
}

TEST_F(LogSurveyTest, SaysWhatDamageTookAndWhere) {
  const std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  WriteRawLog(path_, events);
  std::string bytes = ReadBytes(path_);
  const size_t at = RecordOffset(events, PushOf(5));
  const size_t size = RecordSize(events[PushOf(5)]) + RecordSize(events[PushOf(5) + 1]);
  bytes[at + 1] ^= 1;                                       // magic of PUSH 5
  bytes[RecordOffset(events, PushOf(5) + 1) + 24] ^= 0x40;  // data length of COMMAND 5
  WriteBytes(path_, bytes);
  const std::vector<std::string> problems = SurveyLog(path_).Problems(0);
  ASSERT_EQ(problems.size(), 3u) << testing::PrintToString(problems);
  EXPECT_EQ(problems[0], "damage at byte " + std::to_string(at) + ": " + std::to_string(size) +
                             " bytes are no event (2 events lost, numbers 11 to 12), between "
                             "COMMAND of tick 4 and PUSH of tick 6");
  EXPECT_EQ(problems[1], "PUSH: 1 of its messages missing: tick 5");
  EXPECT_EQ(problems[2], "COMMAND: 1 of its messages missing: tick 5");
}

TEST_F(LogSurveyTest, DamagedRunInfoLeavesTheEvents) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  events[0].data[0] ^= 0xFF;  // of its fingerprint
  const std::vector<std::string> problems = Problems(events);
  ASSERT_EQ(problems.size(), 2u) << testing::PrintToString(problems);
  EXPECT_NE(problems[0].find("RUN_INFO"), std::string::npos);
  EXPECT_TRUE(survey_.channels.empty());
  ASSERT_EQ(survey_.others.size(), 4u);
  EXPECT_EQ(survey_.others[2].ticks.name, "PUSH");
  EXPECT_EQ(survey_.others[2].ticks.messages, kLogSurveyTicks);
}

TEST_F(LogSurveyTest, StrangersAndAMissingEndAreProblems) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  events.push_back({"PU\x01H", 0, Push(0)});
  EXPECT_EQ(Problem(events), "'PU\\x01H' is no channel of the run: 1 messages");
  events = SmallLog(kLogSurveyTicks);
  events.pop_back();
  EXPECT_NE(Problem(events).find("ended at tick 10"), std::string::npos);
}

TEST_F(LogSurveyTest, CutLogIsARunsLog) {
  WriteRawLog(path_, SmallLog(kLogSurveyTicks));
  const std::string cut = folder_.path("cut");
  const CutResult result = CutLog(path_, {3, 6, {}}, cut);
  EXPECT_EQ(result.events, 1 + 2 * 4);
  const LogSurvey survey = SurveyLog(cut);
  EXPECT_TRUE(survey.Problems(0).empty());
  EXPECT_EQ(survey.first_tick, 3);
  EXPECT_EQ(survey.end_tick, 7);
  EXPECT_EQ(survey.spec.run_id(), 42);
  EXPECT_EQ(survey.info.started_at, SurveyLog(path_).info.started_at);

  // The messages are the same bytes, in the same order.
  LogReader reader(cut);
  LogEvent event;
  ASSERT_TRUE(reader.Next(&event));
  for (size_t i = PushOf(3); i < PushOf(7); ++i) {
    ASSERT_TRUE(reader.Next(&event));
    const RawEvent raw = SmallLog(kLogSurveyTicks)[i];
    EXPECT_EQ(event.channel, raw.channel);
    EXPECT_EQ(event.utime, raw.utime);
    EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), raw.data.begin(), raw.data.end()));
  }
  EXPECT_FALSE(reader.Next(&event));

  // A cut of a cut, of one channel.
  const std::string again = folder_.path("again");
  CutLog(cut, {5, INT64_MAX, {"PUSH"}}, again);
  const LogSurvey small = SurveyLog(again);
  EXPECT_TRUE(small.Problems(0).empty());
  ASSERT_EQ(small.channels.size(), 1u);
  EXPECT_EQ(small.channels[0].ticks.messages, 2);
  // What is lost from a cut log shows all the same.
  std::string bytes = ReadBytes(cut);
  WriteBytes(cut, bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(SurveyLog(cut).Problems(0).size(), 2u);
}

TEST_F(LogSurveyTest, CutKeepsWhatCameBeforeTheFirstTickAndAfterTheLast) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  health_t health{};
  SetHeader(0, &health);
  health.component = "robot";
  health.tick = -1;  // it starts
  events.insert(events.begin() + 1, {"HEALTH_ROBOT", 0, Encode(health)});
  emergency_stop_t stop{};
  stop.run_id = 42;
  events.push_back({"STOP", kLogSurveyTicks * 2000, Encode(stop)});
  WriteRawLog(path_, events);
  const auto count = [&](const CutRange& range) {
    static int number = 0;
    return CutLog(path_, range, folder_.path("cut" + std::to_string(number++))).events;
  };
  EXPECT_EQ(count({}), static_cast<int64_t>(events.size()));
  EXPECT_EQ(count({0, 4, {}}), 1 + 1 + 2 * 5);
  EXPECT_EQ(count({5, INT64_MAX, {}}), 1 + 2 * 5 + 2);
  EXPECT_EQ(count({2, 4, {}}), 1 + 2 * 3);
}

TEST_F(LogSurveyTest, CutCountsAsUnreadableOnlyWhatIsInItsRange) {
  std::vector<RawEvent> events = SmallLog(kLogSurveyTicks);
  events[PushOf(2)].data.resize(30);
  events[PushOf(6)].data.resize(30);
  events[PushOf(7)].data.resize(30);
  WriteRawLog(path_, events);
  EXPECT_EQ(CutLog(path_, {}, folder_.path("all")).refused, 3);
  EXPECT_EQ(CutLog(path_, {5, 8, {}}, folder_.path("end")).refused, 2);
  EXPECT_EQ(CutLog(path_, {3, 5, {}}, folder_.path("middle")).refused, 0);
}

TEST_F(LogSurveyTest, CutRefusesWhatCannotBe) {
  WriteRawLog(path_, SmallLog(kLogSurveyTicks));
  const auto refusal = [&](const CutRange& range, const std::string& to) -> std::string {
    try {
      CutLog(path_, range, to);
    } catch (const LogError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal({10, 20, {}}, folder_.path("a")).find("holds ticks 0 to 9"), std::string::npos);
  EXPECT_NE(refusal({5, 4, {}}, folder_.path("a")).find("holds ticks"), std::string::npos);
  EXPECT_NE(refusal({0, 9, {"PUHS"}}, folder_.path("a")).find("did you mean PUSH"),
            std::string::npos);
  EXPECT_NE(refusal({}, path_).find("exists"), std::string::npos);
  EXPECT_NE(refusal({}, folder_.path("no/such")).find("cannot be written"), std::string::npos);
  EXPECT_EQ(refusal({}, folder_.path("a")), "");
}

TEST(TicksOfTimes, BoundsAreIncluded) {
  RunSpec spec;
  spec.set_tick_period(0.002);
  const CutRange range = TicksOfTimes(0.1, 0.2, spec);
  EXPECT_EQ(range.first_tick, 50);
  EXPECT_EQ(range.last_tick, 100);
  EXPECT_EQ(TicksOfTimes(0.1001, 0.1019, spec).first_tick, 51);
  EXPECT_EQ(TicksOfTimes(0.1001, 0.1019, spec).last_tick, 50);
  EXPECT_EQ(TicksOfTimes(-5, 1e300, spec).first_tick, 0);
  spec.set_lead_ticks(1000);
  EXPECT_EQ(TicksOfTimes(0.1, 0.2, spec).first_tick, 1050);
  EXPECT_EQ(TicksOfTimes(-2, 0.2, spec).first_tick, 0);
  EXPECT_EQ(TicksOfTimes(-1, 0.2, spec).first_tick, 500);
}

}  // namespace
}  // namespace poise::logging
