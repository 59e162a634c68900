// A robot that steps stands where no centre of pressure within its feet can stop it.
#include <gtest/gtest.h>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

/// The measured value of a check.
double Measured(const nlohmann::json& summary, const std::string& name) {
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == name) return check["measured"].get<double>();
  }
  ADD_FAILURE() << "no check " << name;
  return 0;
}

/// The same push with steps, and without: then it is a fall.
void ExpectStands(const std::string& scenario, const std::string& world) {
  const RunFolder folder;
  const std::vector<std::string> push = {"run",     scenario, "--variant", "step",
                                         "--world", world,    "--inline",  "--no-reference"};
  std::vector<std::string> steps = push, stays = push;
  steps.insert(steps.end(), {"--out", folder / "steps"});
  const ProgramResult with = RunPoise(steps);
  EXPECT_EQ(with.exit_code, 0) << with.output;
  const nlohmann::json summary = ReadSummary(folder / "steps");
  EXPECT_GE(Measured(summary, "steps"), 1);
  EXPECT_GT(Measured(summary, "foothold_margin_min"), 0);
  // The foot is down after the decision, and a leg takes some tenths of a second.
  const double swing = Measured(summary, "step_touch_down") - Measured(summary, "step_decision");
  EXPECT_GT(swing, 0.15);
  EXPECT_LT(swing, 0.8);
  stays.insert(stays.end(),
               {"--out", folder / "stays", "--set", "step_planner.recovery.enabled=false"});
  const ProgramResult without = RunPoise(stays);
  EXPECT_EQ(without.exit_code, 1) << without.output;
  EXPECT_NE(without.output.find("fell"), std::string::npos) << without.output;
}

TEST(Step, CatchesAPushOnBothFeet) {
  for (const char* world : {"ode", "mujoco"}) ExpectStands("push_double_support", world);
}

TEST(Step, CatchesAPushOnOneFoot) {
  for (const char* world : {"ode", "mujoco"}) ExpectStands("push_single_support", world);
}

}  // namespace
}  // namespace poise
