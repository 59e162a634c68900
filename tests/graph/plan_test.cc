// Plans whose phases depend on what happened, in whole runs.
#include <gtest/gtest.h>

#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

// Section 7.5 without its block: the foot searches, finds nothing and comes up; then it is put down
// on the floor, loaded, and the COM goes back between the feet.
TEST(Plan, AFootThatFindsNoSurfaceIsPutDownElsewhere) {
  const RunFolder folder;
  const ProgramResult result =
      RunPoise({"run", "unknown_surface", "--variant", "block_missing_step_down", "--inline",
                "--out", folder / "run"});
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const logging::RunRecord run = logging::ReadRun(folder / "run/run.lcm");
  std::vector<std::pair<int, int>> began;  // phase, outcome of the one before
  double lowest = 1, raised = -1, put_down = 1;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const planner_status_t& planner = *run.planner.at(tick);
    if (began.empty() || began.back().first != planner.phase) {
      began.emplace_back(planner.phase, planner.began_by);
      if (planner.phase == 4) raised = run.truth.at(tick)->foot_pose[1].position[2];
      if (planner.phase == 5) put_down = run.truth.at(tick)->foot_pose[1].position[2];
    }
    if (planner.phase == 2) {
      lowest = std::min(lowest, run.truth.at(tick)->foot_pose[1].position[2]);
    }
  }
  using Status = planner_status_t;
  EXPECT_EQ(began, (std::vector<std::pair<int, int>>{{0, Status::OUTCOME_NONE},
                                                     {1, Status::OUTCOME_DONE},
                                                     {2, Status::OUTCOME_DONE},
                                                     {4, Status::OUTCOME_NO_SURFACE},
                                                     {5, Status::OUTCOME_DONE}}));
  // From 85 mm, 70 mm down, 50 mm up again, and onto the floor; the leg's friction takes some mm.
  EXPECT_NEAR(lowest, 0.015, 0.01);
  EXPECT_NEAR(raised, lowest + 0.05, 0.015);
  EXPECT_NEAR(put_down, 0, 0.01);
  // Both feet carry at the end.
  for (const wrench_t& wrench : run.sensors.at(run.num_ticks - 1)->foot_wrench) {
    EXPECT_LT(wrench.force[2], -100);
  }
}

TEST(Plan, ThatCannotWorkIsRefusedWithItsLine) {
  const TestDeploy deploy;
  const std::string file = deploy.Scenario("lost",
                                           "base: \"base/stand\"\n"
                                           "step_planner {\n"
                                           "  phase { name: \"there\" }\n"
                                           "}\n");
  // The base's phase never ends, and so this one is never reached.
  ExpectUsageError({"graph", "check", file},
                   {file + ":3: step_planner.phase[0]", "never reached", "'stand'"});
  ExpectUsageError(
      {"run", StandScenario(), "--set", "step_planner.phase[stand].next[0].on=NO_SURFACE", "--set",
       "step_planner.phase[stand].next[0].to=nowhere"},
      {"no phase is called 'nowhere'"});
}

}  // namespace
}  // namespace poise
