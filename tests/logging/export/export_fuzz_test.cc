// Whatever stands in a log, its tools write it or refuse it with one line.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "components/framework/configuration/configuration.h"
#include "components/robot/robot_model.h"
#include "logging/export/log_export.h"
#include "logging/export/signal_table.h"
#include "logging/log_cut.h"
#include "logging/log_survey.h"
#include "logging/replay/compare.h"
#include "logging/replay/component_replay.h"
#include "logging/run_record.h"
#include "tests/logging/damage_trial.h"
#include "tests/logging/small_log.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

namespace fs = std::filesystem;

constexpr int kDamagedLogs = 150;
constexpr int64_t kExportFuzzTicks = 30;

/// Reads PUSH and the operator's STOP, and answers with COMMAND.
class AnswerStage final : public Component {
 public:
  void Configure(const ComponentContext&, Wiring* wiring) override {
    wiring->AddInput(&push_, "push", {});
    wiring->AddInput(&stop_, "stop", {}, InputKind::kLatest);
    wiring->AddOutput(&command_, "command", {12});
    wiring->AddStage("answer", {&push_, &stop_}, {&command_}, [this](const Tick&) {
      for (double& current : command_->current) current = push_->force[0] - 0.25;
      for (auto& enabled : command_->enabled) enabled = 1;
    });
  }

 private:
  Input<external_push_t> push_;
  Input<emergency_stop_t> stop_;
  Output<drive_command_t> command_;
};

RunSpec SpecWithComponent() {
  RunSpec spec = SmallSpec();
  ComponentInstance* instance = spec.mutable_graph()->add_component();
  instance->set_name("answer");
  const auto connect = [](Connection* connection, const char* port, const char* channel) {
    connection->set_port(port);
    connection->set_channel(channel);
  };
  connect(instance->add_input(), "push", "PUSH");
  connect(instance->add_input(), "stop", "STOP");
  connect(instance->add_output(), "command", "COMMAND");
  return spec;
}

class ExportFuzzTest : public testing::Test {
 protected:
  ExportFuzzTest() {
    registry_.Add("answer", "", [] { return std::make_unique<AnswerStage>(); });
    std::vector<RawEvent> events = SmallLog(kExportFuzzTicks);
    events[0] = RunInfoEvent(SpecWithComponent());
    emergency_stop_t stop{};
    stop.run_id = 42;
    events.insert(events.begin() + 20, {"STOP", 18'000, Encode(stop)});
    WriteRawLog(folder_.path("whole.lcm"), events);
    whole_ = ReadBytes(folder_.path("whole.lcm"));
    info_end_ = RecordOffset(events, 1);
  }

  /// Every tool on the log. An error must be one of those that the programs turn into a line.
  void TryAll() {
    Try([&] { SurveyLog(log_).Problems(0); });
    Try([&] { ExportCsv(log_, folder_.path("csv")); });
    fs::remove_all(folder_.path("csv"));
    Try([&] { ExportMergedCsv(log_, folder_.path("merged.csv")); });
    Try([&] { ExportMcap(log_, folder_.path("log.mcap")); });
    Try([&] { CutLog(log_, {3, 20, {}}, folder_.path("cut.lcm")); });
    fs::remove(folder_.path("cut.lcm"));
    Try([&] { CompareLogs(folder_.path("whole.lcm"), log_); });
    Try([&] {
      const LogReplay replay(log_);
      for (int i = 0; i < replay.spec().graph().component_size(); ++i) {
        Try([&] { replay.Replay(replay.spec(), i, registry_); });
      }
    });
    Try([&] {
      const RunRecord run = ReadRun(log_);
      ReadColumns(log_, run);
    });
    for (const auto& entry : fs::directory_iterator(folder_.path(""))) {
      EXPECT_NE(entry.path().extension(), ".part") << entry.path();
    }
  }
  template <class Tool>
  void Try(Tool tool) {
    try {
      tool();
      ++done_;
    } catch (const LogError& error) {
      EXPECT_NE(std::string(error.what()), "");
      ++refused_;
    } catch (const ConfigError&) {  // GraphError too
      ++refused_;
    } catch (const robot::RobotError&) {
      ++refused_;
    }
  }

  TemporaryFolder folder_;
  std::string log_ = folder_.path("damaged.lcm");
  ComponentRegistry registry_;
  std::string whole_;
  size_t info_end_ = 0;
  int done_ = 0;
  int refused_ = 0;
};

TEST_F(ExportFuzzTest, AWholeLogReplaysToItsBits) {
  const LogReplay replay(folder_.path("whole.lcm"));
  const ReplayedComponent answer = replay.Replay(replay.spec(), 0, registry_);
  EXPECT_TRUE(answer.equal());
  EXPECT_EQ(answer.ticks, kExportFuzzTicks);
  EXPECT_EQ(answer.external_messages, 1);
}

TEST_F(ExportFuzzTest, DamageAnywhere) {
  std::mt19937 random(TestSeed(11));
  for (int i = 0; i < kDamagedLogs; ++i) {
    SCOPED_TRACE(i);
    WriteBytes(log_, i % 3 == 0 ? CutAnywhere(whole_, &random)
                                : Overwrite(whole_, 1 + random() % 40, &random));
    TryAll();
  }
  EXPECT_GT(done_, kDamagedLogs);
  EXPECT_GT(refused_, kDamagedLogs / 10);
}

TEST_F(ExportFuzzTest, DamageInTheMessagesAlone) {
  std::mt19937 random(TestSeed(12));
  for (int i = 0; i < kDamagedLogs; ++i) {
    SCOPED_TRACE(i);
    WriteBytes(log_, whole_.substr(0, info_end_) +
                         Overwrite(whole_.substr(info_end_), 1 + random() % 40, &random));
    TryAll();
  }
  EXPECT_GT(done_, kDamagedLogs);
}

TEST_F(ExportFuzzTest, DamageInRunInfoAlone) {
  std::mt19937 random(TestSeed(13));
  for (int i = 0; i < kDamagedLogs; ++i) {
    SCOPED_TRACE(i);
    WriteBytes(log_, Overwrite(whole_.substr(0, info_end_), 1 + random() % 8, &random) +
                         whole_.substr(info_end_));
    TryAll();
  }
  EXPECT_GT(done_, kDamagedLogs);
  EXPECT_GT(refused_, kDamagedLogs / 10);
}

}  // namespace
}  // namespace poise::logging
