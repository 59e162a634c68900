// Files are found beside the file that names them, then among the installed ones; and files of
// one's own to begin with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>

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
  // The name is of this folder's, though there is none of that name installed.
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

constexpr char kGraphHead[] =
    "# proto-file: components/framework/graph.proto\n# proto-message: poise.Graph\n";

TEST_F(ScenarioPlaceTest, AGraphLeavesOutWhatItNamesOfItsBase) {
  const std::string head = std::string(kGraphHead) + "name: \"mine\"\nbase: \"balance\"\n";
  Write("own/mine.pbtxt", head + "remove: \"redistributer\"\n");
  ExpectUsageError({"graph", "check", "own/mine.pbtxt"},
                   {Full("own/mine.pbtxt") + ":5: remove[0]: the base has no component or channel "
                                             "'redistributer'; did you mean redistributor"});
  Write("own/mine.pbtxt", std::string(kGraphHead) + "name: \"mine\"\nremove: \"sim\"\n");
  ExpectUsageError({"graph", "check", "own/mine.pbtxt"}, {":4: remove[0]: there is no base"});
  // What nobody writes then is told where it is declared.
  Write("own/mine.pbtxt", head + "remove: \"redistributor\"\n");
  ExpectUsageError({"graph", "check", "own/mine.pbtxt"},
                   {(kDeploy / "graphs/balance.pbtxt").string() + ":1",
                    "channel JOINT_COMMAND: hw_bridge reads it, but nobody writes it"});
  Write("own/mine.pbtxt", head +
                              "remove: \"contact_wrench_monitor\"\nremove: \"redistributor\"\n"
                              "remove: \"task_controller\"\nremove: \"TASK_TORQUE\"\n"
                              "remove: \"JOINT_COMMAND\"\n"
                              "channel { name: \"JOINT_COMMAND\" type: \"joint_command_t\" "
                              "external: true }\n");
  const ProgramResult both = RunPoise({"graph", "check", "own/mine.pbtxt"});  // a line each
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.output,
              HasSubstr("nobody writes it; remove it (of a base's: remove: \"BALANCE_TORQUE\")"));
  EXPECT_THAT(both.output, HasSubstr("hw_bridge: input joint_command waits for its message, but "
                                     "channel JOINT_COMMAND"));
  // Another takes the place of one of its name; a fault in it is found in its own line.
  const std::string component =
      "component {\n  name: \"task_controller\"\n"
      "  input { port: \"robot_state\" channel: \"ROBOT_STATE\" }\n"
      "  input { port: \"support_plan\" channel: \"SUPPORT_PLAN\" }\n"
      "  output { port: \"task_torque\" channel: \"TASK_TORQUE\" }\n}\n";
  Write("own/mine.pbtxt", head + "remove: \"task_controller\"\n" + component);
  ExpectGood("own/mine.pbtxt", "names, types and connections are good");
  std::string wrong = component;
  wrong.replace(wrong.find("\"SUPPORT_PLAN\""), 14, "\"SUPORT_PLAN\"");
  Write("own/mine.pbtxt", head + "remove: \"task_controller\"\n" + wrong);
  ExpectUsageError({"graph", "check", "own/mine.pbtxt"},
                   {Full("own/mine.pbtxt") + ":9: component[0].input[1].channel",
                    "unknown channel 'SUPORT_PLAN'"});
}

// The recipe has it (docs/how-to/unitree_robot.md).
TEST_F(ScenarioPlaceTest, AGraphForARealRobotIsBalanceWithoutItsSimulator) {
  const std::string page = ReadFile(POISE_SOURCE_DIR "/docs/how-to/unitree_robot.md");
  const size_t begin = page.find("    base: \"balance\"\n");
  ASSERT_NE(begin, std::string::npos);
  Write("own/g1.pbtxt", page.substr(begin, page.find("\n\nIn a file", begin) - begin));
  ExpectGood("own/g1.pbtxt", "names, types and connections are good");
}

TEST_F(ScenarioPlaceTest, AFileIsCheckedAsWhatItsHeaderSays) {
  std::string graph = ReadFile((kDeploy / "graphs/balance.pbtxt").string());
  const size_t at = graph.find("channel {");
  const auto line = 1 + std::count(graph.begin(), graph.begin() + static_cast<ptrdiff_t>(at), '\n');
  graph[graph.find('{', at)] = '[';
  Write("own/broken.pbtxt", graph);
  ExpectUsageError({"graph", "check", "own/broken.pbtxt"}, {Full("own/broken.pbtxt") + ":" + std::to_string(line) + ":"});
}

TEST_F(ScenarioPlaceTest, AGraphMayHaveItsScenariosName) {
  fs::copy_file(StandScenario(), "own/stand.pbtxt");
  Write("own/policy.pbtxt",
        "# proto-message: poise.Scenario\nbase: \"stand\"\ngraph: \"policy\"\n");
  ExpectUsageError(
      {"graph", "check", "own/policy.pbtxt"},
      {Full("own/policy.pbtxt") + ":3: graph: no graph named 'policy'; use one of balance",
       Full("own/policy.pbtxt") + " (which says that it is a Scenario)"});
  Write("path/share/poise/graphs/policy.pbtxt",
        std::string(kGraphHead) + "name: \"policy\"\nbase: \"balance\"\n");
  setenv("POISE_PATH", fs::absolute("path").c_str(), 1);
  ExpectGood("own/policy.pbtxt", Full("path/share/poise/graphs/policy.pbtxt"));
  unsetenv("POISE_PATH");
}

TEST_F(ScenarioPlaceTest, DrivesKeepTheScenariosOwnGraphAndTypeOrRefuseThem) {
  fs::copy_file(StandScenario(), "own/stand.pbtxt");
  Write("own/springs.pbtxt", std::string(kGraphHead) + "name: \"springs\"\nbase: \"balance\"\n");
  Write("own/mine.pbtxt", "base: \"stand\"\ngraph: \"springs\"\nduration: 0.02\n");
  ExpectUsageError({"run", "own/mine.pbtxt", "--drives", "ethercat"},
                   {Full("own/mine.pbtxt") + ":2: graph", "springs", "balance_ethercat"});
  ExpectUsageError({"run", "own/stand.pbtxt", "--drives", "ethercat", "--set", "graph=balance"},
                   {"--set graph", "balance_ethercat"});
  // One that has the drives is run.
  Write("own/springs.pbtxt",
        std::string(kGraphHead) + "name: \"springs\"\nbase: \"balance_ethercat\"\n");
  const ProgramResult own =
      RunPoise({"run", "own/mine.pbtxt", "--drives", "ethercat", "--out", "own_graph"});
  EXPECT_THAT(ReadFile("own_graph/run_spec.pbtxt"), HasSubstr("name: \"springs\"")) << own.output;

  const auto profile = [](const std::string& scenario, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"run",      scenario,     "--drives",
                                          "ethercat", "--out",      "of_profile",
                                          "--force",  "--duration", "0.02"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    RunPoise(arguments);
    return ReadFile("of_profile/scenario.pbtxt");
  };
  EXPECT_THAT(profile("own/stand.pbtxt", {}), HasSubstr("name: \"elmo_gold\""));
  EXPECT_THAT(profile("own/stand.pbtxt", {"--set", "drive_profile=synapticon_somanet"}),
              HasSubstr("name: \"synapticon_somanet\""));
  Write("own/mine.pbtxt", "base: \"stand\"\ndrive_profile: \"synapticon_somanet\"\n");
  EXPECT_THAT(profile("own/mine.pbtxt", {}), HasSubstr("name: \"synapticon_somanet\""));
  const std::string by_hand = ReadFile((kDeploy / "drives/elmo_gold.pbtxt").string());
  std::string renamed = by_hand;
  renamed.replace(renamed.find("\"elmo_gold\""), 11, "\"my_drives\"");
  const std::string group = "hw_bridge { ethercat { master { profile {\n" + renamed + "\n} } } }\n";
  Write("own/mine.pbtxt", "base: \"stand\"\n" + group);
  EXPECT_THAT(profile("own/mine.pbtxt", {}), HasSubstr("name: \"my_drives\""));
  Write("own/mine.pbtxt", "base: \"stand\"\ndrive_profile: \"elmo_gold\"\n" + group);
  ExpectUsageError({"run", "own/mine.pbtxt", "--drives", "ethercat"},
                   {Full("own/mine.pbtxt") + ":2: drive_profile", "leave one of both out"});
  // What nothing of the run reads is refused.
  ExpectUsageError(
      {"run", "own/stand.pbtxt", "--drives", "ethercat", "--set", "drive_profile=none"},
      {"drive_profile", "none"});
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, std::vector<std::string>{"--drives", "unitree"}}) {
    std::vector<std::string> arguments = {"run", "own/stand.pbtxt", "--set",
                                          "drive_profile=elmo_gold"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ExpectUsageError(arguments, {"drive_profile", "--drives ethercat"});
  }
}

}  // namespace
}  // namespace poise
