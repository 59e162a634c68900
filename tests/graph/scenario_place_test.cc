// Files are found beside the file that names them, then among the installed ones; and files of
// one's own to begin with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "tests/graph/current_folder.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kDeploy = POISE_SOURCE_DIR "/deploy";

class ScenarioPlaceTest : public ::testing::Test {
 protected:
  ScenarioPlaceTest() : here(fs::path(folder / "")) { fs::create_directory("own"); }

  static void Write(const fs::path& file, const std::string& text) {
    fs::create_directories(fs::absolute(file).parent_path());
    std::ofstream(file) << text;
  }
  static std::string Full(const fs::path& file) { return fs::absolute(file).string(); }
  static void ExpectGood(const std::string& name, const std::string& part = "all good") {
    const ProgramResult result = RunPoise({"graph", "check", name});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_THAT(result.output, HasSubstr(part));
  }

  RunFolder folder;
  CurrentFolder here;
};

TEST_F(ScenarioPlaceTest, ACopiedScenarioFindsItsBaseItsRobotAndItsGraph) {
  for (const auto& entry : fs::directory_iterator(kDeploy / "scenarios")) {
    if (!entry.is_regular_file()) continue;
    fs::copy_file(entry.path(), fs::path("own") / entry.path().filename());
    ExpectGood("own/" + entry.path().filename().string(),
               (kDeploy / "graphs/balance.pbtxt").string());
  }
  ExpectGood("own/push_double_support");  // without its ending too
  const ProgramResult drives = RunPoise({"run", "own/push_double_support.pbtxt", "--drives",
                                         "ethercat", "--duration", "0.01", "--out", "run"});
  EXPECT_EQ(drives.output.find("poise: no "), std::string::npos) << drives.output;
}

TEST_F(ScenarioPlaceTest, WhatLiesBesideTheFileComesFirst) {
  Write("own/mine.pbtxt", "base: \"stand\"\nrobot: \"legs\"\ngraph: \"balance\"\n");
  fs::copy_file(StandScenario(), "own/stand.pbtxt");
  for (const char* ending : {".pbtxt", ".urdf"}) {
    fs::copy_file(kDeploy / "robots/dyros" / ("dyros_legs" + std::string(ending)),
                  fs::path("own") / ((*ending == '.' && ending[1] == 'p' ? "legs" : "dyros_legs") +
                                     std::string(ending)));
  }
  fs::copy_file(kDeploy / "graphs/balance.pbtxt", "own/balance.pbtxt");
  ExpectGood("own/mine.pbtxt", Full("own/balance.pbtxt"));
  // Of this folder, though there is none of that name installed.
  const CurrentFolder own("own");
  ExpectGood("mine");
  ExpectGood("balance", "names, types and connections are good");
}

TEST_F(ScenarioPlaceTest, AnErrorListsThePathsSearched) {
  Write("own/mine.pbtxt", "base: \"base/paper_robbot\"\n");
  ExpectUsageError({"graph", "check", "own/mine.pbtxt"},
                   {Full("own/mine.pbtxt") + ":1: base: no scenario named 'base/paper_robbot'",
                    "did you mean base/paper_robot?", "searched: ",
                    Full("own/base/paper_robbot.pbtxt") + ", " +
                        (kDeploy / "scenarios/base/paper_robbot.pbtxt").string()});
  fs::copy_file(StandScenario(), "own/stand.pbtxt");
  for (const auto& [field, name, kind, near] :
       {std::tuple{"robot", "dyros/dyros_leg", "robots", "dyros/dyros_legs"},
        std::tuple{"graph", "balence", "graphs", "balance"}}) {
    Write("own/mine.pbtxt", std::string("base: \"stand\"\n") + field + ": \"" + name + "\"\n");
    ExpectUsageError({"graph", "check", "own/mine.pbtxt"},
                     {Full("own/mine.pbtxt") + ":2: " + field, std::string("did you mean ") + near,
                      Full(std::string("own/") + name + ".pbtxt"),
                      (kDeploy / kind / (std::string(name) + ".pbtxt")).string()});
  }
  ExpectUsageError({"run", "nothing/like/this.pbtxt"}, {Full("nothing/like/this.pbtxt")});
  ExpectUsageError({"sweep", "push_directions_dubble"},
                   {"no sweep or scenario named", "push_directions_double"});
}

TEST_F(ScenarioPlaceTest, ASweepFindsItsScenarioBesideIt) {
  fs::copy_file(StandScenario(), "own/standing.pbtxt");
  Write("own/pushes.pbtxt",
        "scenario: \"standing\"\nvary { field: \"sim.push[0].peak\" value: [10, 20] }\n");
  const ProgramResult sweep = RunPoise({"sweep", "own/pushes", "--quiet", "--out", "pushes"});
  EXPECT_EQ(sweep.exit_code, 0) << sweep.output;
  EXPECT_TRUE(fs::exists("pushes/table.csv"));
  Write("own/pushes.pbtxt",
        "scenario: \"sitting\"\nvary { field: \"sim.push[0].peak\" value: [10, 20] }\n");
  ExpectUsageError({"sweep", "own/pushes.pbtxt"},
                   {Full("own/pushes.pbtxt") + ":1: scenario: no scenario named 'sitting'",
                    Full("own/sitting.pbtxt")});
}

TEST_F(ScenarioPlaceTest, ANewScenarioRunsWhereItIs) {
  const ProgramResult made = RunPoise({"new", "scenario", "mine"});
  EXPECT_EQ(made.exit_code, 0) << made.output;
  EXPECT_THAT(made.output, HasSubstr("poise run mine"));
  EXPECT_THAT(ReadFile("mine.pbtxt"), HasSubstr("name: \"mine\"\n"));
  const ProgramResult run = RunPoise({"run", "mine", "--inline", "--out", "run"});
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_EQ(ReadSummary("run")["scenario"], "mine");
  ExpectUsageError({"new", "scenario", "mine"}, {Full("mine.pbtxt"), "is there already"});
  ExpectUsageError({"new", "scenario", "../mine"}, {"letters, digits"});
  ExpectUsageError({"new", "scenario", "other", "--from", "push_doubel_support"},
                   {"did you mean push_double_support"});
  EXPECT_FALSE(fs::exists("other.pbtxt"));
}

TEST_F(ScenarioPlaceTest, ANewScenarioMayBeACopy) {
  ASSERT_EQ(RunPoise({"new", "scenario", "copy", "--from", "push_double_support"}).exit_code, 0);
  const std::string copy = ReadFile("copy.pbtxt");
  std::string text = ReadFile((kDeploy / "scenarios/push_double_support.pbtxt").string());
  text.replace(text.find("push_double_support"), 19, "copy");
  const std::string note = "# Made from push_double_support by poise new scenario.\n";
  const size_t at = copy.find(note);
  ASSERT_NE(at, std::string::npos) << copy;
  EXPECT_EQ(std::string(copy).erase(at, note.size()), text);
  ExpectGood("copy", "variants too: best_strategy");

  // What only the other folder has is named by its path.
  fs::copy_file(StandScenario(), "own/stand.pbtxt");
  Write("own/mine.pbtxt", "# Mine.\nbase: \"stand\"  # beside\nduration: 0.2\n");
  ASSERT_EQ(RunPoise({"new", "scenario", "second", "--from", "own/mine"}).exit_code, 0);
  EXPECT_EQ(ReadFile("second.pbtxt"),
            "# Mine.\n# Made from own/mine by poise new scenario.\nname: \"second\"\nbase: \"" +
                Full("own/stand.pbtxt") + "\"  # beside\nduration: 0.2\n");
  ExpectGood("second");
}

}  // namespace
}  // namespace poise
