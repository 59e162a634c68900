// A walk from start to stop in both engines, and its replay.
#include <gtest/gtest.h>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

double Measured(const nlohmann::json& summary, const std::string& name) {
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == name) return check["measured"].get<double>();
  }
  ADD_FAILURE() << "no check " << name;
  return 0;
}

/// Ten steps of 0.1 m and the one beside it.
const std::vector<std::string> kTenSteps = {"--set",      "step_planner.walk.command[1].time=11",
                                            "--set",      "step_planner.walk.command[1].stop=true",
                                            "--set",      "step_planner.walk.command[2].stop=true",
                                            "--duration", "17"};

TEST(WalkRun, TenStepsAndAStopInEachEngine) {
  for (const std::string engine : {"mujoco", "ode"}) {
    const RunFolder folder;
    std::vector<std::string> arguments = {"run",  "walk",  "--inline",    "--world",
                                          engine, "--out", folder / "run"};
    arguments.insert(arguments.end(), kTenSteps.begin(), kTenSteps.end());
    const ProgramResult result = RunPoise(arguments);
    EXPECT_EQ(result.exit_code, 0) << engine << result.output;
    const nlohmann::json summary = ReadSummary(folder / "run");
    EXPECT_EQ(Measured(summary, "fallen"), 0) << engine;
    EXPECT_EQ(Measured(summary, "violated_ticks"), 0) << engine;
    EXPECT_GE(Measured(summary, "steps"), 9) << engine;
    EXPECT_LE(Measured(summary, "steps"), 12) << engine;
    // Eight of the strides' steps at least, 0.1 m each.
    EXPECT_GT(Measured(summary, "walk_way"), 0.6) << engine;
    if (engine == "ode") continue;
    const ProgramResult replay = RunPoise({"replay", folder / "run"});
    EXPECT_EQ(replay.exit_code, 0) << replay.output;
  }
}

// Seven steps on stairs and a stand with a foot on each of two treads, of which one lies across the
// other's edge. The stretched leg fell off the stairs down at 13 s, the stand on two treads up.
TEST(WalkRun, UpAndDownStairsToAStandOnThem) {
  for (const std::string engine : {"mujoco", "ode"}) {
    for (const std::string way : {"up", "down"}) {
      const RunFolder folder;
      std::vector<std::string> arguments = {
          "run",        "walk_stairs", "--inline",
          "--world",    engine,        "--out",
          folder / way, "--set",       "step_planner.walk.command[1].time=20",
          "--duration", "30"};
      if (way == "down") arguments.insert(arguments.end(), {"--variant", "down"});
      RunPoise(arguments);  // its exit code: the scenario asks for 20 steps
      const nlohmann::json summary = ReadSummary(folder / way);
      EXPECT_EQ(Measured(summary, "fallen"), 0) << engine << way;
      EXPECT_EQ(Measured(summary, "violated_ticks"), 0) << engine << way;
      EXPECT_EQ(Measured(summary, "duration_reached"), 30) << engine << way;
      EXPECT_GE(Measured(summary, "steps"), 6) << engine << way;
      EXPECT_LE(Measured(summary, "steps"), 9) << engine << way;
    }
  }
}

// What a scenario leaves open is filled for walking: with the rule's values for standing this
// falls.
TEST(WalkRun, AScenarioThatStandsWalksOnceItIsToldTo) {
  const RunFolder folder;
  const ProgramResult result = RunPoise(
      {"run", "stand", "--inline", "--duration", "19", "--out", folder / "run", "--set",
       "step_planner.walk.enabled=true", "--set", "step_planner.walk.command[0].time=4", "--set",
       "step_planner.walk.command[0].vx=0.1", "--set", "step_planner.walk.command[1].time=14",
       "--set", "step_planner.walk.command[1].stop=true"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(Measured(ReadSummary(folder / "run"), "fallen"), 0);
}

}  // namespace
}  // namespace poise
