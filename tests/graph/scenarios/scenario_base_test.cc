// Scenarios that are based on other files.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

/// base/robot.pbtxt is the scenario "stand" with one check; derived.pbtxt is based on it.
class ScenarioBaseTest : public testing::Test {
 protected:
  ScenarioBaseTest() {
    std::filesystem::create_directory(folder_ / "base");
    std::string text;
    std::istringstream lines(ReadFile(StandScenario()));
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("check")) text += line + "\n";
    }
    Write("base/robot", text + "check { metric: \"fallen\" at_most: 0 }\n");
  }

  std::string File(const std::string& name) const { return folder_ / (name + ".pbtxt"); }

  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(File(name)) << text;
    return File(name);
  }

  /// A scenario based on base/robot with `text` from line 2 on.
  std::string Derived(const std::string& text) {
    return Write("derived", "base: \"base/robot\"\n" + text);
  }

  /// The line of base/robot that begins with `start`, spaces aside, as "FILE:LINE: ".
  std::string BaseLine(const std::string& start) const {
    std::istringstream lines(ReadFile(File("base/robot")));
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      if (line.find_first_not_of(' ') == line.find(start)) {
        return File("base/robot") + ":" + std::to_string(number) + ": ";
      }
    }
    ADD_FAILURE() << start;
    return "";
  }

  /// `poise graph check` refuses the scenario with a message that holds `parts`.
  void ExpectRefused(const std::string& file, const std::vector<std::string>& parts) {
    ExpectUsageError({"graph", "check", file}, parts);
  }

  RunFolder folder_;
};

TEST_F(ScenarioBaseTest, SingleValuesAreReplacedAndListsAppended) {
  const std::string file = Derived(
      "duration: 0.1\n"
      "redistributor { double_support { half_width: 0.06 } }\n"
      "check { metric: \"push_peak\" }\n");
  const ProgramResult result = RunPoise({"run", file, "--inline", "--out", folder_ / "run"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const nlohmann::json summary = ReadSummary(folder_ / "run");
  EXPECT_EQ(summary["planned_ticks"], 50);
  const nlohmann::json& checks = summary["checks"];
  ASSERT_EQ(checks.size(), 7u);  // five of every run
  EXPECT_EQ(checks[5]["name"], "fallen");
  EXPECT_EQ(checks[6]["name"], "push_peak");

  // The run's folder has the whole scenario, which runs by itself.
  const std::string merged = ReadFile(folder_ / "run/scenario.pbtxt");
  EXPECT_EQ(merged.find("base:"), std::string::npos) << merged;
  EXPECT_NE(merged.find("half_length: 0.12\n    half_width: 0.06\n"), std::string::npos) << merged;
  const ProgramResult again = RunPoise(
      {"run", folder_ / "run/scenario.pbtxt", "--inline", "--out", folder_ / "again", "--quiet"});
  EXPECT_EQ(again.exit_code, 0) << again.output;
  const ProgramResult same = RunPoise({"compare", folder_ / "run", folder_ / "again"});
  EXPECT_EQ(same.exit_code, 0) << same.output;
}

TEST_F(ScenarioBaseTest, AnErrorNamesTheFileThatSetTheField) {
  Derived("description: \"x\"\ncheck { metric: \"push_peek\" }\n");
  ExpectRefused(File("derived"), {File("derived") + ":3: check[0].metric", "push_peak"});
  Derived("duration: -2\n");
  ExpectRefused(File("derived"), {File("derived") + ":2: duration"});
  Derived("redistributor {\n  double_support {\n    half_width: -1 } }\n");
  ExpectRefused(File("derived"), {File("derived") + ":4: redistributor.double_support.half_width"});
  Derived("no_such: 1\n");
  ExpectRefused(File("derived"), {File("derived") + ":2:", "no_such"});

  std::string base = ReadFile(File("base/robot"));
  Write("base/robot", base + "check { metric: \"push_impulze\" }\n");
  Derived("");
  ExpectRefused(File("derived"),
                {BaseLine("check { metric: \"push_impulze"), "check[1].metric", "push_impulse"});
  base.replace(base.find("half_length: 0.13"), 17, "half_length: -13.");
  Write("base/robot", base);
  ExpectRefused(File("derived"), {BaseLine("double_support { half_length: -13"),
                                  "contact_wrench_monitor.double_support.half_length"});
  Write("base/robot", base + "no_such: 1\n");
  ExpectRefused(File("derived"),
                {BaseLine("no_such").substr(0, BaseLine("no_such").size() - 1), "no_such"});
}

TEST_F(ScenarioBaseTest, IndexesOfListsMapToTheFileOfTheElement) {
  // Phase 0 is the base's; of the lists inside sim, the base has six joints and a push.
  Derived(
      "step_planner {\n"
      "  phase { name: \"later\" duration: -1 }\n"
      "}\n");
  ExpectRefused(File("derived"), {File("derived") + ":3: step_planner.phase[0]"});
  Derived(
      "sim {\n"
      "  start {\n"
      "    nominal { joint: \"left_hip_roll\" position: 0 }\n"
      "    nominal { joint: \"tail\" position: 0 }\n"
      "  }\n"
      "}\n");
  ExpectRefused(File("derived"), {File("derived") + ":5: sim.start.nominal[1]", "tail"});
  Derived(
      "sim {\n"
      "  push { start: 0.2 duration: 0.1 peak: 10 direction_x: 1 link: \"tail\" }\n"
      "}\n");
  ExpectRefused(File("derived"), {File("derived") + ":3: sim.push[0].link", "tail"});
  Derived("");
  std::string base = ReadFile(File("base/robot"));
  base.replace(base.find("left_knee_pitch"), 15, "left_knee_patch");
  Write("base/robot", base);
  ExpectRefused(File("derived"),
                {BaseLine("nominal { joint: \"left_knee_patch"), "sim.start.nominal[4]"});
}

TEST_F(ScenarioBaseTest, WhatTheBaseHasIsRemovedAndReplaced) {
  Write("base/robot", ReadFile(File("base/robot")) +
                          "check { metric: \"push_peek\" }\nvariant { name: \"one\" }\n");
  const std::string remove = "remove: \"check\"\nremove: \"variant\"\nremove: \"sim.push\"\n";
  const std::string file =
      Derived(remove + "duration: 0.1\ncheck { metric: \"violated_ticks\" }\n");
  const ProgramResult result = RunPoise({"run", file, "--inline", "--out", folder_ / "run"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const nlohmann::json checks = ReadSummary(folder_ / "run")["checks"];
  ASSERT_EQ(checks.size(), 6u);  // five of every run
  EXPECT_EQ(checks[5]["name"], "violated_ticks");
  const std::string merged = ReadFile(folder_ / "run/scenario.pbtxt");
  for (const char* gone : {"remove:", "variant {", "push {"}) {
    EXPECT_EQ(merged.find(gone), std::string::npos) << merged;
  }

  // The elements that are left are counted from 0, in their own file.
  Derived(remove + "check { metric: \"fallen\" }\ncheck { metric: \"push_peek\" }\n");
  ExpectRefused(File("derived"), {File("derived") + ":6: check[1].metric", "push_peek"});
  const auto refused = [this](const std::string& path, const std::string& problem) {
    Derived("description: \"x\"\nremove: \"" + path + "\"\n");
    ExpectRefused(File("derived"), {File("derived") + ":3: remove[0]: ", problem});
  };
  for (const char* path : {"chek", "sim.pushes", "check[0]", "check.metric", "seed"}) {
    refused(path, fmt::format("the base sets no field '{}'", path));
  }
  Write("derived", "remove: \"check\"\n");
  ExpectRefused(File("derived"), {File("derived") + ":1: remove[0]: there is no base"});
}

TEST_F(ScenarioBaseTest, BasesNestAndRelativeNamesAreThoseOfTheirFile) {
  std::filesystem::create_directory(folder_ / "base/parts");
  std::string base = ReadFile(File("base/robot"));
  base.replace(base.find("dyros/dyros_legs"), 16, "../legs.pbtxt");
  Write("base/parts/robot", base);
  Write("base/robot", "base: \"parts/robot\"\ncheck { metric: \"push_peek\" }\n");
  Derived("check { metric: \"push_impulse\" }\n");
  ExpectRefused(File("derived"), {File("base/robot") + ":2: check[0].metric"});
  Write("base/robot", "base: \"parts/robot\"\n");
  ExpectRefused(File("derived"),
                {File("base/parts/robot") + ":", "robot: ", folder_ / "base/legs.pbtxt"});
}

TEST_F(ScenarioBaseTest, ALoopOrAMissingBaseIsAnError) {
  Write("base/robot", "name: \"robot\"\nbase: \"../derived\"\n");
  Derived("");
  ExpectRefused(File("derived"), {File("base/robot") + ":2: base", "loop"});
  Write("self", "base: \"self\"\n");
  ExpectRefused(File("self"), {File("self") + ":1: base", "loop"});
  Write("derived", "base: \"base/robbot\"\n");
  ExpectRefused(File("derived"), {File("derived") + ":1: base", "did you mean base/robot?"});
  Write("derived", "base: \"no/folder\"\n");
  ExpectRefused(File("derived"), {File("derived") + ":1: base"});
  Write("derived", "base: \"\"\n");
  ExpectRefused(File("derived"), {File("derived") + ":1: base"});
}

TEST_F(ScenarioBaseTest, AnAssumptionMayNameAFieldOfEitherFile) {
  const std::string assumption = "assumption { kind: \"assumed\" field: ";
  Derived(assumption + "\"sim.push[0].peak\" }\n" + assumption + "\"duration\" }\n");
  EXPECT_EQ(RunPoise({"graph", "check", File("derived")}).exit_code, 0);
  Derived(assumption + "\"sim.push[1].peak\" }\n");
  ExpectRefused(File("derived"), {File("derived") + ":2: assumption[0].field", "push[1]"});
  Derived(assumption + "\"sim.drive_train.backlash\" }\n");
  ExpectRefused(File("derived"), {File("derived") + ":2: assumption[0].field", "backlash"});
}

TEST(ScenarioBase, FilesInBaseAreNotOfferedToRun) {
  const TestDeploy deploy;
  deploy.Scenario("mine", "base: \"base/stand\"\ndescription: \"derived from it\"\n");
  const ProgramResult list = RunPoise({"list", "scenarios"});
  EXPECT_NE(list.output.find("mine"), std::string::npos) << list.output;
  EXPECT_NE(list.output.find("derived from it (0.4 s)"), std::string::npos) << list.output;
  EXPECT_EQ(list.output.find("base/"), std::string::npos) << list.output;
  ExpectUsageError({"run", "base/stand"},
                   {"no scenario named 'base/stand'", "mine", "which others build on"});
  EXPECT_EQ(RunPoise({"graph", "check", "mine"}).exit_code, 0);
}

}  // namespace
}  // namespace poise
