// Whole graphs against the wall clock. No test here depends on how fast the machine is: what is
// asked is who takes whose place, and what is left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

using ::testing::HasSubstr;

int LinesWith(const std::string& text, const std::string& begin) {
  std::istringstream in(text);
  int count = 0;
  for (std::string line; std::getline(in, line);) count += line.starts_with(begin) ? 1 : 0;
  return count;
}

TEST(Realtime, EveryProcessThatIsKilledIsReplacedAndTheRobotMissesNoCycle) {
  RunFolder folder;
  const std::string run = folder / "run";
  const ProgramResult result = RunPoise({"run", StandScenario(), "--realtime", "--duration", "3",
                                         "--kill", "4", "--kill-seed", "3", "--out", run});
  const int killed = LinesWith(result.output, "killed ");
  const int faults = killed + LinesWith(result.output, "stopped 100 ms ");
  ASSERT_GE(faults, 1) << result.output;
  EXPECT_THAT(result.output, HasSubstr(std::to_string(faults) + " faults, " +
                                       std::to_string(killed) + " processes replaced"));
  EXPECT_TRUE(ProcessesWith(run).empty());
  const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
  EXPECT_EQ(record.damages, 0);
  ASSERT_GT(record.num_ticks, 100);
  // The last ones may be under way when the run ends.
  for (int64_t tick = 0; tick < record.num_ticks - 20; ++tick) {
    ASSERT_NE(record.truth.at(tick), nullptr) << tick;
    ASSERT_NE(record.bridge.at(tick), nullptr) << tick;
  }
  int32_t restarts = 0;
  for (const auto& [name, health] : record.health) restarts += health.restarts;
  EXPECT_LE(restarts, killed);
}

TEST(Realtime, AHostedControllerThatIsKilledIsReplacedAsOne) {
  RunFolder folder;
  const std::string run = folder / "run";
  const ProgramResult result =
      RunPoise({"run", StandScenario(), "--realtime", "--hosted", "--duration", "3", "--kill", "4",
                "--kill-seed", "3", "--out", run});
  const int killed = LinesWith(result.output, "killed ");
  const int faults = killed + LinesWith(result.output, "stopped 100 ms ");
  ASSERT_GE(killed, 1) << result.output;
  EXPECT_THAT(result.output, HasSubstr("3 processes (controller: state_estimator, step_planner"));
  EXPECT_THAT(result.output, HasSubstr(std::to_string(faults) + " faults, " +
                                       std::to_string(killed) + " processes replaced"));
  EXPECT_TRUE(ProcessesWith(run).empty());
  const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
  ASSERT_GT(record.num_ticks, 100);
  for (int64_t tick = 0; tick < record.num_ticks - 20; ++tick) {
    ASSERT_NE(record.bridge.at(tick), nullptr) << tick;
  }
  // All were replaced together.
  for (const char* name : {"state_estimator", "step_planner", "task_controller",
                           "contact_wrench_monitor", "redistributor"}) {
    EXPECT_EQ(record.health.at(name).restarts, killed) << name;
  }
}

TEST(Realtime, ALongRunNeedsNoLog) {
  RunFolder folder;
  const std::string run = folder / "run";
  const ProgramResult result = RunPoise(
      {"run", StandScenario(), "--realtime", "--no-log", "--duration", "0.5", "--out", run});
  EXPECT_THAT(result.output, HasSubstr("cycles late"));
  EXPECT_FALSE(std::filesystem::exists(run + "/run.lcm"));
  EXPECT_TRUE(ProcessesWith(run).empty());
}

TEST(Realtime, RefusesWhatOnlyRealTimeHas) {
  ExpectUsageError({"run", StandScenario(), "--kill", "2"}, {"--kill", "--realtime"});
  ExpectUsageError({"run", StandScenario(), "--realtime", "--inline", "--no-log"}, {"--no-log"});
  RunFolder folder;
  ExpectUsageError({"run", StandScenario(), "--realtime", "--kill", "100", "--duration", "1",
                    "--out", folder / "run"},
                   {"--kill 100", "one in 0.5 s"});
}

TEST(Hosting, RefusesGroupsThatCannotLiveTogether) {
  ExpectUsageError({"run", StandScenario(), "--host", "a=hw_bridge,redistributor"},
                   {"--host a=hw_bridge,redistributor: component hw_bridge: owns the clock"});
  ExpectUsageError({"run", StandScenario(), "--host", "a=sim,redistributor"},
                   {"component redistributor: has restart: true, but sim, in the same process a, "
                    "has restart: false"});
  ExpectUsageError({"run", StandScenario(), "--host", "a=state_estimater,redistributor"},
                   {"has no component 'state_estimater'; did you mean state_estimator?"});
  ExpectUsageError({"run", StandScenario(), "--host", "a=redistributor"},
                   {"must be PROCESS=A,B: two or more components of the graph"});
  ExpectUsageError({"run", StandScenario(), "--hosted", "--inline"}, {"--hosted", "--inline"});
}

}  // namespace
}  // namespace poise
