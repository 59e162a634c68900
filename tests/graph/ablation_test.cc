// Variants, ablations, the reference run, and several scenarios in one go.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "logging/replay/compare.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kBase[] = "base: \"base/stand\" duration: 0.3\n";

/// True when a program holds the lock that a run in progress has on its folder.
bool IsLocked(const fs::path& dir) {
  const int fd = open(dir.c_str(), O_RDONLY | O_DIRECTORY);
  EXPECT_GE(fd, 0) << dir;
  const bool locked = flock(fd, LOCK_SH | LOCK_NB) != 0;
  close(fd);
  return locked;
}

class AblationTest : public testing::Test {
 protected:
  /// Runs to the folder `name` with `flags`; expects success. Returns the folder.
  std::string Run(const std::string& name, const std::string& scenario,
                  const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = {"run",     scenario, "--inline",
                                          "--force", "--out",  deploy_ / name};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    const ProgramResult result = RunPoise(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    output_ = result.output;
    return deploy_ / name;
  }

  static bool Equal(const std::string& first, const std::string& second) {
    const logging::LogComparison result =
        logging::CompareLogs(first + "/run.lcm", second + "/run.lcm");
    EXPECT_GT(result.messages, 0);
    return result.equal();
  }

  void ExpectOutput(const std::string& part) const {
    EXPECT_NE(output_.find(part), std::string::npos) << part << " in " << output_;
  }

  TestDeploy deploy_;
  std::string output_;
};

TEST_F(AblationTest, AVariantIsTheScenarioWithItsFieldsSet) {
  const std::string file = deploy_.Scenario(
      "mine", std::string(kBase) +
                  "variant { name: \"hard\" description: \"A harder push\"\n"
                  "  set: \"sim.push[0].peak=90\" set: \"seed=5\" }\n"
                  "variant { name: \"own\" check { metric: \"push_peak\" at_least: 50 } }\n");
  const std::string hard = Run("hard", "mine", {"--variant", "hard"});
  ExpectOutput("A harder push");
  ExpectOutput("variant hard: sim.push[0].peak=90, seed=5");
  EXPECT_TRUE(Equal(hard, Run("set", "mine", {"--set", "sim.push[0].peak=90", "--seed", "5"})));
  EXPECT_FALSE(Equal(hard, Run("plain", "mine")));
  // The command line has the last word.
  EXPECT_TRUE(Equal(
      Run("back", "mine", {"--variant", "hard", "--set", "seed=1", "--set", "sim.push[0].peak=60"}),
      Run("plain", "mine")));
  const nlohmann::json summary = ReadSummary(hard);
  EXPECT_EQ(summary["variant"], "hard");
  ASSERT_EQ(summary["changes"].size(), 2u);
  EXPECT_EQ(summary["changes"][0]["by"], "variant hard");
  EXPECT_EQ(summary["changes"][0]["set"], "sim.push[0].peak=90");
  EXPECT_EQ(summary["checks"].size(), 8u);  // five of every run, three of base/stand
  const nlohmann::json own = ReadSummary(Run("own", "mine", {"--variant", "own"}));
  ASSERT_EQ(own["checks"].size(), 6u);
  EXPECT_EQ(own["checks"][5]["name"], "push_peak");

  const ProgramResult list = RunPoise({"list", "scenarios"});
  EXPECT_NE(list.output.find("--variant hard: A harder push"), std::string::npos) << list.output;
  ExpectUsageError({"run", "mine", "--variant", "hrd"}, {"--variant hrd", file, "hard"});
  ExpectUsageError({"run", StandScenario(), "--variant", "x"}, {"has no variants"});
}

TEST_F(AblationTest, AWrongVariantHasFileAndLine) {
  const auto expect_refused = [&](const std::string& text, const std::vector<std::string>& parts) {
    const std::string file = deploy_.Scenario("mine", kBase + text);
    std::vector<std::string> all = parts;
    all.push_back(file + ":3: ");
    // The rest of the file is checked as well: what it gives stands below the error.
    const ProgramResult result = RunPoise({"graph", "check", "mine"});
    EXPECT_EQ(result.exit_code, 2) << result.output;
    const std::string error = result.output.substr(0, result.output.find('\n'));
    EXPECT_EQ(error.find("poise: "), 0u) << result.output;
    EXPECT_EQ(result.output.find("poise: ", 1), std::string::npos) << result.output;
    for (const std::string& part : all) {
      EXPECT_NE(error.find(part), std::string::npos) << part << " in " << result.output;
    }
  };
  expect_refused("variant { name: \"a\"\n set: \"sim.push[0].peek=1\" }",
                 {"variant[0].set[0]", "peek", "peak"});
  expect_refused("variant { name: \"a\"\n set: \"sim.push[0].peak=much\" }",
                 {"variant[0].set[0]", "much"});
  expect_refused("variant { name: \"a\"\n set: \"duration\" }", {"variant[0].set[0]", "value"});
  expect_refused("variant { name: \"a\"\n set: \"duration=-1\" }",
                 {"variant[0].set[0]", "duration"});
  expect_refused("variant { name: \"a\"\n set: \"redistributor.double_support.half_width=0\" }",
                 {"variant[0].set[0]", "redistributor.double_support.half_width"});
  expect_refused("variant { name: \"a\" }\nvariant { check { metric: \"nothing\" } name: \"b\" }",
                 {"variant[1].check[0].metric", "nothing"});
  expect_refused("variant { name: \"a\" }\nvariant { name: \"a/b\" }", {"variant[1].name"});
  expect_refused("variant { name: \"a\" }\nvariant { name: \"a\" }", {"two variants"});
  expect_refused("variant { name: \"abc\" }\nreference: \"abd\"", {"reference", "abc"});
  expect_refused("variant { name: \"a\"\n set: \"base=other\" }", {"variant[0].set[0]", "base"});
}

TEST_F(AblationTest, AWrongNameOrLimitHasFileAndLine) {
  const auto expect_refused = [&](const std::string& text, const std::vector<std::string>& parts) {
    std::vector<std::string> all = parts;
    all.push_back(deploy_.Scenario("mine", kBase + text) + ":2: ");
    ExpectUsageError({"graph", "check", "mine"}, all);
  };
  // A name becomes a folder's.
  for (const char* name : {"../escaped", "a/b", "..", "a b", "", "\\303\\244"}) {
    expect_refused(std::string("name: \"") + name + "\"", {"name: is '", "letters, digits"});
  }
  expect_refused("check { metric: \"fallen\" at_most: nan }", {"check[0].at_most", "finite"});
  expect_refused("check { metric: \"fallen\" at_least: -inf }", {"check[0].at_least", "finite"});
  expect_refused("check { metric: \"fallen\" paper_value: nan }", {"paper_value", "finite"});
}

TEST_F(AblationTest, AFileNameThatIsNoNameBecomesOne) {
  // base/stand's name would count: a scenario of its own.
  std::string text = ReadFile(StandScenario());
  const size_t name = text.find("name: \"stand\"");
  ASSERT_NE(name, std::string::npos);
  text.erase(name, text.find('\n', name) - name);
  EXPECT_EQ(ReadSummary(Run("run", deploy_.Scenario("un named..two", text)))["scenario"],
            "un_named__two");
}

TEST_F(AblationTest, AWrongFlagIsNamed) {
  deploy_.Scenario("mine", std::string(kBase) +
                               "check_from: 0.25 variant { name: \"abc\" }\nreference: \"abc\"\n");
  const auto expect_refused = [&](const std::string& flag, const std::string& value,
                                  const std::string& message) {
    ExpectUsageError({"run", "mine", flag, value, "--out", deploy_ / "none"}, {message});
  };
  expect_refused("--set", "check[0].at_most=nan", "--set check[0].at_most: is nan");
  expect_refused("--set", "base=nothing", "--set base: cannot be set");
  expect_refused("--set", "variant[0].set=seed=3", "--set variant[0].set: cannot be set");
  expect_refused("--set", "applied.variant=a", "--set applied.variant: cannot be set");
  expect_refused("--set", "reference=abd", "--set reference: no variant named 'abd'");
  expect_refused("--set", "name=../escaped", "--set name: is '../escaped'");
  expect_refused("--duration", "0.2", "--duration: duration: is 0.2 s; must be more than");
  EXPECT_FALSE(fs::exists(deploy_ / "none"));
}

TEST_F(AblationTest, EachPartIsSwitchedOffByItsField) {
  deploy_.Scenario("mine",
                   std::string(kBase) +
                       "sim { push { start: 0.02 duration: 0.1 peak: 250 direction_y: 1 link: "
                       "\"upper_body\" } } "  // so that balancing has something to do
                       "variant { name: \"any\" check { metric: \"fallen\" } }");
  const std::vector<std::string> any = {"--variant", "any"};  // checks no condition
  const std::string plain = Run("plain", "mine", any);
  const std::pair<const char*, const char*> parts[] = {
      {"balancing", "contact_wrench_monitor.balancing=false"},
      {"redistribution", "redistributor.redistribution=false"},
      {"transition", "redistributor.transition=false"}};
  for (const auto& [part, set] : parts) {
    const std::string without = Run(part, "mine", {any[0], any[1], "--without", part});
    ExpectOutput(std::string("--without ") + part + ": " + set);
    EXPECT_TRUE(Equal(without, Run("set", "mine", {any[0], any[1], "--set", set}))) << part;
    // Without contact changes there is nothing that a transition does.
    EXPECT_EQ(Equal(without, plain), part == std::string("transition")) << part;
  }
  const nlohmann::json summary = ReadSummary(Run(
      "two", "mine", {any[0], any[1], "--without", "redistribution", "--without", "balancing"}));
  EXPECT_EQ(summary["ablations"],
            nlohmann::json::array({"--without redistribution", "--without balancing"}));
  ExpectUsageError({"run", "mine", "--without", "legs"}, {"--without", "legs", "balancing"});
}

TEST_F(AblationTest, AnIdealRobotIsTheModelWithoutNoise) {
  deploy_.Scenario("mine", kBase);
  deploy_.Scenario("imperfect",
                   std::string(kBase) +
                       "sim { drive_train { torque_lag: 0.002 } rotor_inertia: false\n"
                       "  motor_change { joint: \"left_knee_pitch\" torque_constant: 0.9 }\n"
                       "  model_error { link: \"upper_body\" mass_scale: 1.02 }\n"
                       "  model_error { link: \"left_shank\" com_x: 0.005 } }\n"
                       "assumption { field: \"sim.drive_train.torque_lag\" kind: \"assumed\" }\n");
  const std::string ideal = Run("ideal", "mine", {"--ideal"});
  ExpectOutput("--ideal: ");
  // Nothing is left that depends on the seed, or on what the scenario says of imperfections.
  EXPECT_TRUE(Equal(ideal, Run("seed", "mine", {"--ideal", "--seed", "2"})));
  EXPECT_TRUE(Equal(ideal, Run("imperfect", "imperfect", {"--ideal"})));
  EXPECT_FALSE(Equal(ideal, Run("plain", "mine")));
  const nlohmann::json summary = ReadSummary(ideal);
  EXPECT_EQ(summary["ablations"], nlohmann::json::array({"--ideal"}));
  // The changes of --ideal, done by hand.
  std::vector<std::string> set;
  for (const nlohmann::json& change : summary["changes"]) {
    set.insert(set.end(), {"--set", change["set"].get<std::string>()});
  }
  EXPECT_TRUE(Equal(ideal, Run("by_hand", "mine", set)));
}

TEST_F(AblationTest, TheReferenceVariantRunsBeside) {
  deploy_.Scenario("mine", std::string(kBase) +
                               "variant { name: \"free\" set: \"sim.push=\" }\n"
                               "variant { name: \"own\" check { metric: \"fallen\" } }\n"
                               "variant { name: \"other\" set: \"seed=3\" }\n"
                               "reference: \"free\"\n");
  const std::string plain = Run("plain", "mine", {"--without", "transition", "--set", "seed=4"});
  EXPECT_EQ(ReadSummary(plain)["reference"]["variant"], "free");
  EXPECT_EQ(ReadSummary(plain)["reference"]["completed"], true);
  // The flags of the command line are the reference's too.
  const std::string reference = plain + "/reference";
  EXPECT_TRUE(Equal(
      reference,
      Run("free", "mine", {"--variant", "free", "--without", "transition", "--set", "seed=4"})));
  EXPECT_FALSE(Equal(reference, plain));
  const auto has_reference = [&](const std::string& run) {
    return std::filesystem::exists(run + "/reference");
  };
  EXPECT_FALSE(has_reference(deploy_ / "free"));
  EXPECT_TRUE(has_reference(Run("other", "mine", {"--variant", "other"})));
  EXPECT_FALSE(has_reference(Run("own", "mine", {"--variant", "own"})));

  EXPECT_EQ(RunPoise({"report", plain, "--no-html"}).output.find("warning"), std::string::npos);
  std::filesystem::remove_all(reference);
  const ProgramResult report = RunPoise({"report", plain, "--no-html"});
  EXPECT_EQ(report.exit_code, 0);
  EXPECT_NE(report.output.find("warning: " + reference), std::string::npos) << report.output;
  // A folder that is used again keeps none of an earlier run.
  Run("plain", "mine");
  EXPECT_TRUE(has_reference(plain));
  Run("plain", "mine", {"--no-reference"});
  EXPECT_FALSE(has_reference(plain));
  EXPECT_TRUE(ReadSummary(plain)["reference"].is_null());
}

TEST_F(AblationTest, AReferenceThatFallsFailsTheRun) {
  // 382 N s on a robot of this size, ten times what it can stand (fall_test.cc).
  deploy_.Scenario("mine", std::string("base: \"base/stand\" duration: 1.5\n") +
                               "variant { name: \"felled\" set: \"sim.push[0].peak=2000\"\n"
                               "  set: \"sim.push[0].duration=0.3\" }\n"
                               "reference: \"felled\"\n");
  const std::string out = deploy_ / "run";
  const ProgramResult result = RunPoise({"run", "mine", "--inline", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  const nlohmann::json summary = ReadSummary(out);
  EXPECT_FALSE(summary["passed"].get<bool>());
  int failed = 0;
  for (const nlohmann::json& check : summary["checks"]) {
    const bool passed = check["passed"].get<bool>();
    EXPECT_EQ(passed, check["name"] != "duration_reached_reference") << check;
    if (!passed) ++failed;
  }
  EXPECT_EQ(failed, 1);
  EXPECT_EQ(RunPoise({"report", out, "--no-html"}).exit_code, 1);
  EXPECT_EQ(
      RunPoise({"run", "mine", "--inline", "--no-reference", "--force", "--out", out}).exit_code,
      0);
}

TEST_F(AblationTest, ARunIsTheLatestBeforeItsReferenceRuns) {
  deploy_.Scenario("mine",
                   "base: \"base/stand\" name: \"mine\"\n"
                   "variant { name: \"long\" set: \"duration=1000\" }\nreference: \"long\"\n");
  const std::string latest = deploy_.runs() + "/latest";
  PoiseProgram program({"run", "mine"});
  ASSERT_TRUE(WaitForLog(latest + "/reference", 100'000));
  EXPECT_TRUE(fs::read_symlink(latest).string().ends_with("-mine"));
  EXPECT_TRUE(fs::exists(latest + "/run_spec.pbtxt"));
  EXPECT_TRUE(IsLocked(latest));
  EXPECT_FALSE(fs::exists(latest + "/run.lcm"));
  kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1);
  // Without a log, too, there is a verdict.
  EXPECT_TRUE(result.output.ends_with("FAILED: interrupted (Interrupt)\n")) << result.output;
  EXPECT_FALSE(ReadSummary(latest)["passed"].get<bool>());
  ExpectUsageError({"report", "--no-html"}, {"latest/run.lcm", "never came to start"});
}

TEST_F(AblationTest, LatestIsTheRunInProgressOfSeveral) {
  deploy_.Scenario("first", std::string(kBase) + "name: \"first\" paper_section: \"7\"");
  deploy_.Scenario("second",
                   "base: \"base/stand\" duration: 1000 name: \"second\" paper_section: \"8\"");
  const fs::path latest = deploy_.runs() + "/latest";
  PoiseProgram program({"run", "all"});
  ASSERT_TRUE(WaitUntil([&] { return fs::exists(latest / "../second/run.lcm"); }));
  EXPECT_TRUE(fs::read_symlink(latest).string().ends_with("-all/second"));
  EXPECT_FALSE(IsLocked(latest / "../first"));
  EXPECT_TRUE(IsLocked(latest));
  const ProgramResult echo = RunPoise({"echo", "ROBOT_STATE", "--count", "1"});
  EXPECT_EQ(echo.exit_code, 0) << echo.output;
  kill(program.pid(), SIGINT);
  program.Wait();
  EXPECT_FALSE(IsLocked(latest));
}

TEST_F(AblationTest, ARunThatCannotBeMadeFailsAndTheOthersGoOn) {
  deploy_.Scenario("first", std::string(kBase) + "name: \"first\"");
  deploy_.Scenario("second", std::string(kBase) + "name: \"second\"");
  const std::string out = deploy_ / "several";
  fs::create_directory(out);
  std::ofstream(out + "/first") << "a file where the run's folder should be";
  const ProgramResult result =
      RunPoise({"run", "first", "second", "--inline", "--force", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_TRUE(ReadSummary(out + "/second")["passed"].get<bool>());
  ASSERT_NE(result.output.find("section  scenario"), std::string::npos) << result.output;
  const std::string overview = result.output.substr(result.output.find("section  scenario"));
  EXPECT_NE(overview.find("first     FAILED"), std::string::npos) << overview;
  EXPECT_NE(overview.find("first: --out " + out + "/first: cannot be made"), std::string::npos)
      << overview;
  EXPECT_NE(overview.find("second    passed"), std::string::npos) << overview;
}

TEST_F(AblationTest, AllRunsTheExperimentsInTheOrderOfTheirSections) {
  deploy_.Scenario("a_late", std::string(kBase) +
                                 "name: \"a_late\" paper_section: \"7.10\"\n"
                                 "check { metric: \"push_peak\" paper: \"60.5 N\" }\n");
  deploy_.Scenario("early", std::string(kBase) + "name: \"early\" paper_section: \"7.2\"\n");
  deploy_.Scenario("other", std::string(kBase) + "name: \"other\"\n");
  const ProgramResult result = RunPoise({"run", "all", "--inline"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  const std::string overview = result.output.substr(result.output.find("section  scenario"));
  EXPECT_NE(overview.find("\n7.2      early     passed\n7.10     a_late    passed   largest push"),
            std::string::npos)
      << overview;
  EXPECT_NE(overview.find("60.5 N\n"), std::string::npos) << overview;
  EXPECT_EQ(overview.find("other"), std::string::npos) << overview;
  EXPECT_NE(overview.find("all passed"), std::string::npos) << overview;
  const std::string latest = std::filesystem::read_symlink(deploy_.runs() + "/latest").string();
  EXPECT_TRUE(latest.ends_with("-all/a_late")) << latest;
  EXPECT_EQ(RunPoise({"report", "--no-html"}).exit_code, 0);
}

TEST_F(AblationTest, SeveralScenariosFailWithOneOfThem) {
  deploy_.Scenario("good", std::string(kBase) + "name: \"good\"");
  deploy_.Scenario(
      "bad", std::string(kBase) + "name: \"bad\" check { metric: \"push_peak\" at_most: 1 }\n");
  const std::string out = deploy_ / "several";
  const ProgramResult result =
      RunPoise({"run", "bad", "good", "good", "--inline", "--quiet", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_FALSE(ReadSummary(out + "/bad")["passed"].get<bool>());
  EXPECT_TRUE(ReadSummary(out + "/good")["passed"].get<bool>());
  EXPECT_TRUE(ReadSummary(out + "/good-2")["passed"].get<bool>());
  // A wrong one is found before any has run.
  ExpectUsageError({"run", "good", "--variant", "x", "bad", "--out", deploy_ / "none"}, {"x"});
  EXPECT_FALSE(std::filesystem::exists(deploy_ / "none"));
}

TEST_F(AblationTest, AnInterruptEndsAllRuns) {
  deploy_.Scenario("long",
                   "base: \"base/stand\" duration: 1000 name: \"long\" paper_section: \"7\"");
  deploy_.Scenario("more", std::string(kBase) + "name: \"more\" paper_section: \"8\"");
  const std::string out = deploy_ / "all";
  PoiseProgram program({"run", "all", "--out", out});
  ASSERT_TRUE(WaitForLog(out + "/long", 100'000));
  kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("not run"), std::string::npos) << result.output;
  EXPECT_FALSE(std::filesystem::exists(out + "/more"));
  EXPECT_TRUE(ProcessesWith(out).empty());
}

// Joint friction keeps the paper's push from felling the robot: without it the scenario's `ideal`
// says what is asked.
TEST(IdealRobot, HoldsWhatTheExperimentsAskOfIt) {
  const RunFolder folder;
  for (const char* experiment : {"gravity_compensation", "push_double_support",
                                 "push_single_support", "contact_transition", "unknown_surface"}) {
    const ProgramResult result = RunPoise(
        {"run", experiment, "--ideal", "--inline", "--quiet", "--out", folder / experiment});
    EXPECT_EQ(result.exit_code, 0) << experiment << "\n" << result.output;
  }
  const nlohmann::json summary = ReadSummary(folder / "push_double_support");
  bool asked = false;
  for (const auto& check : summary["checks"]) {
    if (check["name"] != "push_peak") continue;
    asked = true;
    EXPECT_NEAR(check["measured"].get<double>(), 155, 1);
    EXPECT_EQ(check["paper"], "188.91 N");
  }
  EXPECT_TRUE(asked);
}

TEST(IdealRobot, FallsByThePapersPush) {
  const RunFolder folder;
  const ProgramResult result =
      RunPoise({"run", "push_double_support", "--ideal", "--set", "sim.push[0].peak=188.91",
                "--inline", "--quiet", "--out", folder / "run"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("fell"), std::string::npos) << result.output;
}

}  // namespace
}  // namespace poise
