// A log whose RUN_INFO is damaged, with and without the run's folder around it.
#include "logging/run_info.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "logging/export/log_export.h"
#include "logging/log_cut.h"
#include "logging/log_messages.h"
#include "logging/log_survey.h"
#include "logging/run_log_writer.h"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr int64_t kRunInfoTicks = 10;

class RunInfoTest : public testing::Test {
 protected:
  RunInfoTest() : events_(SmallLog(kRunInfoTicks)) {}

  void WriteSpec(const RunSpec& spec) {
    std::string text;
    google::protobuf::TextFormat::PrintToString(spec, &text);
    WriteBytes(folder_.path("run_spec.pbtxt"), text);
  }
  /// The ways in which RUN_INFO can be of no use.
  std::vector<std::vector<RawEvent>> Damaged() const {
    std::vector<RawEvent> without(events_.begin() + 1, events_.end());
    std::vector<RawEvent> cut = events_;
    cut[0].data.resize(cut[0].data.size() / 2);
    std::vector<RawEvent> unreadable = events_;
    unreadable[0].data[60] = '\xff';
    std::vector<RawEvent> renamed = events_;
    renamed[0].channel = "RUN_INF0";
    RunSpec spec = SmallSpec();
    spec.set_tick_period(-1);
    std::vector<RawEvent> impossible = events_;
    impossible[0] = RunInfoEvent(spec);
    return {without, cut, unreadable, renamed, impossible};
  }
  std::string Refusal() {
    try {
      LogReader reader(log_);
      FindRunInfo(&reader, log_);
    } catch (const LogError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
  std::vector<RawEvent> events_;
  std::string log_ = folder_.path("run.lcm");
};

TEST_F(RunInfoTest, WholeLogsAreTakenAtTheirWord) {
  RunSpec other = SmallSpec();
  other.set_run_id(7);
  WriteSpec(other);
  WriteRawLog(log_, events_);
  LogReader reader(log_);
  const RunInfo run = FindRunInfo(&reader, log_);
  EXPECT_EQ(run.spec.run_id(), 42);
  EXPECT_EQ(run.warning, "");
  EXPECT_EQ(RunInfoWarning(log_), "");
}

TEST_F(RunInfoTest, TheRunsFolderStandsInAndAllMessagesAreRead) {
  WriteSpec(SmallSpec());
  WriteBytes(folder_.path("scenario.pbtxt"), "name: \"small\"");
  for (const std::vector<RawEvent>& events : Damaged()) {
    WriteRawLog(log_, events);
    LogReader reader(log_);
    const RunInfo run = FindRunInfo(&reader, log_);
    EXPECT_EQ(run.spec.run_id(), 42);
    EXPECT_EQ(run.info.scenario, "name: \"small\"");
    EXPECT_EQ(run.info.started_at, "");
    EXPECT_THAT(run.warning, HasSubstr("RUN_INFO"));
    EXPECT_THAT(run.warning, HasSubstr("run_spec.pbtxt"));

    const LogSurvey survey = SurveyLog(log_);
    EXPECT_EQ(survey.end_tick, kRunInfoTicks);
    for (const ChannelSurvey& channel : survey.channels) EXPECT_EQ(channel.ticks.missing, 0);
    EXPECT_FALSE(survey.Problems(0).empty());  // the log is not whole all the same

    // A cut of all of it is a whole log again.
    const std::string cut = folder_.path("cut.lcm");
    CutLog(log_, {}, cut);
    EXPECT_EQ(RunInfoWarning(cut), "");
    EXPECT_TRUE(SurveyLog(cut).Problems(0).empty());
    std::filesystem::remove(cut);
    for (const ExportedChannel& channel : ExportMergedCsv(log_, folder_.path("merged.csv"))) {
      EXPECT_EQ(channel.messages, kRunInfoTicks);
    }
  }
}

TEST_F(RunInfoTest, TheFolderOfAnotherRunDoesNotStandIn) {
  RunSpec other = SmallSpec();
  other.set_run_id(7);
  WriteSpec(other);
  WriteRawLog(log_, Damaged()[0]);
  EXPECT_THAT(Refusal(), HasSubstr("is of run 7, the log's messages are of run 42"));
  WriteBytes(folder_.path("run_spec.pbtxt"), "run_id: 42 tick_period: 0");
  EXPECT_THAT(Refusal(), HasSubstr("tick_period"));
  WriteBytes(folder_.path("run_spec.pbtxt"), "run_id: many");
  EXPECT_THAT(Refusal(), HasSubstr("run_spec.pbtxt"));
}

TEST_F(RunInfoTest, AMessageOfAModuleThatIsNotThereAsksForTheModuleAlone) {
  RunSpec spec = SmallSpec();
  spec.mutable_graph()->mutable_channel(0)->set_type("foreign_t");
  WriteSpec(spec);
  events_[0] = RunInfoEvent(spec);
  WriteRawLog(log_, events_);
  EXPECT_THAT(Refusal(), HasSubstr("has no known type 'foreign_t'"));
  EXPECT_THAT(Refusal(), HasSubstr("modules with others are looked for in"));
  EXPECT_THAT(Refusal(), Not(HasSubstr("beside the log")));
}

TEST_F(RunInfoTest, WithoutTheFolderMessagesAreExportedAndTheRestRefusesSayingWhatToDo) {
  for (const std::vector<RawEvent>& events : Damaged()) {
    WriteRawLog(log_, events);
    EXPECT_THAT(Refusal(), HasSubstr("RUN_INFO"));
    EXPECT_THAT(Refusal(), HasSubstr("put the run's run_spec.pbtxt and scenario.pbtxt beside"));
    EXPECT_THAT(Refusal(), HasSubstr("poise log export"));
    EXPECT_THROW(LogMessages messages(log_), LogError);
    EXPECT_THROW(CutLog(log_, {}, folder_.path("cut.lcm")), LogError);
    EXPECT_EQ(RunInfoWarning(log_), "");

    for (const auto& channels :
         {ExportCsv(log_, folder_.path("csv")), ExportMcap(log_, folder_.path("log.mcap")),
          ExportMergedCsv(log_, folder_.path("merged.csv"))}) {
      int found = 0;
      for (const ExportedChannel& channel : channels) {
        if (channel.channel != "PUSH" && channel.channel != "COMMAND") continue;
        EXPECT_EQ(channel.messages, kRunInfoTicks) << channel.channel;
        EXPECT_EQ(channel.refused, 0) << channel.channel;
        ++found;
      }
      EXPECT_EQ(found, 2);
    }
    std::filesystem::remove_all(folder_.path("csv"));
    const std::string merged = ReadBytes(folder_.path("merged.csv"));
    EXPECT_EQ(std::count(merged.begin(), merged.end(), '\n'), kRunInfoTicks + 1);
    EXPECT_THAT(merged, HasSubstr("time,tick,PUSH.force[0]"));
    EXPECT_THAT(merged, HasSubstr("COMMAND.current[11]"));
  }
}

}  // namespace
}  // namespace poise::logging
