// `poise worlds` and `--world`: the same scenario in every engine, side by side.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

class WorldsTest : public testing::Test {
 protected:
  WorldsTest() {
    setenv("COLUMNS", "200", 1);
    deploy_.Scenario("pushed",
                     "base: \"base/stand\" name: \"pushed\" duration: 0.5\n"
                     "check { metric: \"push_peak\" at_most: 70 label: \"push, largest\""
                     "        paper: \"60 N\" paper_value: 60 }\n");
  }
  ~WorldsTest() override { unsetenv("COLUMNS"); }

  TestDeploy deploy_;
};

TEST_F(WorldsTest, HasEveryCheckOfEveryEngine) {
  const std::string out = deploy_ / "worlds";
  const ProgramResult result = RunPoise({"worlds", "pushed", "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("nearer the paper"), std::string::npos) << result.output;
  std::map<std::string, std::map<std::string, std::string>> measured;
  for (const CsvRow& row : ReadCsv(out + "/worlds.csv")) {
    EXPECT_EQ(row.at("scenario"), "pushed");
    EXPECT_EQ(row.at("passed"), "1") << row.at("label");
    measured[row.at("label")][row.at("engine")] = row.at("measured");
  }
  for (const auto& [label, engines] : measured) EXPECT_EQ(engines.size(), 2u) << label;
  const auto& push = measured.at("push, largest");
  EXPECT_NEAR(std::stod(push.at("ode")), std::stod(push.at("mujoco")), 1);
  EXPECT_TRUE(std::filesystem::exists(out + "/pushed/mujoco/run.lcm"));
  // Both stand: their feet carry the same weight.
  EXPECT_NE(result.output.find("measured wrenches, difference"), std::string::npos);
  const std::vector<CsvRow> wrenches = ReadCsv(out + "/wrenches.csv");
  ASSERT_EQ(wrenches.size(), 4u);
  for (const CsvRow& row : wrenches) {
    EXPECT_GT(std::stod(row.at("rms")), 0);
    EXPECT_LE(std::stod(row.at("rms")), std::stod(row.at("largest")));
    if (row.at("quantity") == "force") {
      EXPECT_LT(std::stod(row.at("rms")), 60);
    }
  }
}

TEST_F(WorldsTest, ASweepIsComparedRunByRun) {
  std::filesystem::create_directories(deploy_ / "deploy/sweeps");
  std::ofstream(deploy_ / "deploy/sweeps/forces.pbtxt")
      << "scenario: \"pushed\"\n"
         "vary { name: \"force\" field: \"sim.push[0].peak\" unit: \"N\" value: 20 value: 60 }\n";
  const std::string out = deploy_ / "worlds";
  // Each engine gets its own fields alone.
  const ProgramResult result = RunPoise({"worlds", "forces", "--set", "ode.contact_cfm=2e-7",
                                         "--set", "mujoco.contact_softness=2e-7", "--out", out});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("the same outcome in 2 of 2 runs"), std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("apart by at most 0 N"), std::string::npos) << result.output;
  for (const char* const engine : {"ode", "mujoco"}) {
    EXPECT_EQ(ReadCsv(out + "/forces/" + engine + "/table.csv").size(), 2u);
  }
}

TEST_F(WorldsTest, AFailedCheckInAnEngineFails) {
  const ProgramResult result = RunPoise(
      {"worlds", "pushed", "--set", "check[push_peak].at_most=1", "--out", deploy_ / "worlds"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("FAILED"), std::string::npos);
}

// The same bits as processes and in one process, as with ODE.
TEST_F(WorldsTest, MujocoGivesTheSameBitsInOneProcessAndInMany) {
  const std::string one = deploy_ / "one", many = deploy_ / "many";
  EXPECT_EQ(RunPoise({"run", "pushed", "--world", "mujoco", "--inline", "--out", one}).exit_code,
            0);
  EXPECT_EQ(
      RunPoise({"run", "pushed", "--world", "mujoco", "--drop", "0.02", "--out", many}).exit_code,
      0);
  const ProgramResult result = RunPoise({"compare", one, many});
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

}  // namespace
}  // namespace poise
