// A fall ends the run, with exit code 1 and a message.
#include <gtest/gtest.h>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

/// A push that no standing robot of this size survives: m sqrt(g/h) times the reach of the foot
/// bounds the impulse (linear inverted pendulum) at about 54.63 kg * 3.6 1/s * 0.18 m = 36 N s;
/// this one has 127 N s.
const std::vector<std::string> kHardPush = {
    "--set", "sim.push[0].peak=1000", "--set", "sim.push[0].duration=0.2", "--duration", "4"};

void ExpectFall(std::vector<std::string> flags) {
  const RunFolder folder;
  std::vector<std::string> arguments = {"run", StandScenario(), "--out", folder / "run"};
  arguments.insert(arguments.end(), flags.begin(), flags.end());
  arguments.insert(arguments.end(), kHardPush.begin(), kHardPush.end());
  const ProgramResult result = RunPoise(arguments);
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("run failed: sim: "), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("fell"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("FAILED"), std::string::npos) << result.output;
  const nlohmann::json summary = ReadSummary(folder / "run");
  EXPECT_FALSE(summary["passed"].get<bool>());
  EXPECT_LT(summary["simulated_time"].get<double>(), 4);
  // What led to the fall is in the log, whole.
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == "log_defects") {
      EXPECT_EQ(check["measured"], 0) << check;
    }
  }
  EXPECT_TRUE(ProcessesWith(folder / "run").empty());
}

TEST(Fall, EndsTheGraphOfProcesses) { ExpectFall({}); }

TEST(Fall, EndsTheGraphInOneProcess) { ExpectFall({"--inline"}); }

TEST(Fall, ThePapersPushFellsTheRobotOnlyWithoutBalancing) {
  const RunFolder folder;
  const ProgramResult with =
      RunPoise({"run", "push_double_support", "--inline", "--out", folder / "with"});
  EXPECT_EQ(with.exit_code, 0) << with.output;
  const ProgramResult without = RunPoise({"run", "push_double_support", "--inline", "--out",
                                          folder / "without", "--without", "balancing"});
  EXPECT_EQ(without.exit_code, 1) << without.output;
  EXPECT_NE(without.output.find("the robot fell"), std::string::npos) << without.output;
}

}  // namespace
}  // namespace poise
