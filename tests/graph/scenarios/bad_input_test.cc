// Bad input gets one line that names the place, and exit code 2.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "tests/graph/poise_program.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

using ::testing::HasSubstr;

class BadInputTest : public testing::Test {
 protected:
  /// The scenario with `from` replaced by `to`.
  std::string Changed(const std::string& from, const std::string& to) {
    std::string text = ReadFile(StandScenario());
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    line_ = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    text.replace(at, from.size(), to);
    std::ofstream(file_) << text;
    return file_;
  }

  /// A usage error, and no run folder.
  void ExpectRefused(const std::vector<std::string>& arguments,
                     const std::vector<std::string>& parts) {
    std::vector<std::string> all = arguments;
    if (arguments[0] == "run") all.insert(all.end(), {"--inline", "--out", folder_ / "run"});
    ExpectUsageError(all, parts);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
  }

  std::string Line() const { return file_ + ":" + std::to_string(line_); }

  RunFolder folder_;
  std::string file_ = folder_ / "scenario.pbtxt";
  std::ptrdiff_t line_ = 0;
};

TEST_F(BadInputTest, UnknownScenarioNamesWhatThereIs) {
  ExpectRefused({"run", "push_double_suport"}, {"push_double_suport", "push_double_support"});
}

// An unset variable in a script would else write where nobody has asked it to.
TEST_F(BadInputTest, AnEmptyArgumentIsRefused) {
  ExpectUsageError({"run", StandScenario(), "--inline", "--out", ""}, {"'--out' is empty"});
  ExpectUsageError({"report", ""}, {"'report' is empty"});
}

TEST_F(BadInputTest, AFolderIsNoScenarioAndItsFilesAreNamed) {
  const std::string folder = folder_ / "mine";
  std::filesystem::create_directory(folder);
  ExpectUsageError({"run", folder, "--inline"}, {"is a folder", "no .pbtxt file"});
  std::filesystem::copy(StandScenario(), folder + "/a.pbtxt");
  ExpectUsageError({"run", folder, "--inline"}, {"is a folder", folder + "/a.pbtxt"});
}

TEST_F(BadInputTest, ARobotWithoutItsMakersFileIsListedAsSuch) {
  const TestDeploy deploy;
  const std::string robots = folder_ / "own/share/poise/robots";
  std::filesystem::create_directories(robots);
  std::ofstream(robots + "/bare.pbtxt") << "urdf: \"bare.urdf\"\n";
  setenv("POISE_PATH", (folder_ / "own").c_str(), 1);
  const ProgramResult table = RunPoise({"robot", "list"});
  const ProgramResult list = RunPoise({"list", "robots"});
  unsetenv("POISE_PATH");
  EXPECT_EQ(table.exit_code, 0) << table.output;
  EXPECT_THAT(table.output, HasSubstr("bare"));
  EXPECT_THAT(list.output, HasSubstr("URDF bare.urdf, which is not here"));
}

TEST_F(BadInputTest, UnknownFlagIsNamed) { ExpectRefused({"run", "--nonsense"}, {"--nonsense"}); }

TEST_F(BadInputTest, NoSubcommand) { ExpectRefused({"--nothing"}, {"--help"}); }

TEST_F(BadInputTest, UnknownFieldHasFileAndLine) {
  const std::string file = Changed("  push {", "  psuh {");
  ExpectRefused({"run", file}, {Line(), "psuh"});
}

TEST_F(BadInputTest, WrongValueOfAComponentHasFileLineAndField) {
  const std::string file = Changed("half_length: 0.13", "half_length: -1");
  ExpectRefused({"run", file}, {Line(), "contact_wrench_monitor.double_support.half_length"});
}

TEST_F(BadInputTest, UnknownJointIsNamed) {
  const std::string file = Changed("joint: \"left_knee_pitch\"", "joint: \"left_knee\"");
  ExpectRefused({"run", file}, {file, "sim.start.nominal[4]", "left_knee"});
}

TEST_F(BadInputTest, UnknownMetricHasNearNames) {
  const std::string file = Changed("metric: \"violated_ticks\"", "metric: \"violated_tick\"");
  ExpectRefused({"run", file}, {Line(), "check[2].metric", "violated_ticks"});
}

TEST_F(BadInputTest, UnknownRobotHasFileAndLine) {
  const std::string file = Changed("dyros/dyros_legs", "dyros/dyros");
  ExpectRefused({"run", file}, {Line(), "robot", "dyros/dyros_legs"});
}

TEST_F(BadInputTest, ImpossibleDuration) {
  const std::string file = Changed("duration: 0.4", "duration: -1");
  ExpectRefused({"run", file}, {Line(), "duration"});
}

TEST_F(BadInputTest, SetNamesItsFlagAndField) {
  ExpectRefused({"run", StandScenario(), "--set", "sim.push[0].peek=1"}, {"--set", "peek", "peak"});
  ExpectRefused({"run", StandScenario(), "--set", "sim.push[0].peak=much"},
                {"--set", "sim.push[0].peak"});
  ExpectRefused({"run", StandScenario(), "--set", "duration"}, {"--set", "value"});
}

TEST_F(BadInputTest, AFormerNameIsAnsweredWithTheNewOne) {
  std::string file = Changed("sim {", "sim_ode {");
  ExpectRefused({"run", file}, {Line(), "write sim { ... }"});
  file = Changed("sim {", "sim { ground { erp: 0.3 }");
  ExpectRefused({"run", file}, {Line(), "write ode { contact_erp: ... } beside sim"});
  ExpectRefused({"run", StandScenario(), "--set", "sim_ode.push[0].peak=120"},
                {"--set sim_ode.push[0].peak", "write sim.push[0].peak"});
  ExpectRefused({"run", StandScenario(), "--set", "sim_ode.ground.cfm=1e-6"},
                {"write ode.contact_cfm"});
  ExpectRefused({"run", Changed("duration: 0.4",
                                "duration: 0.4 assumption { field: "
                                "\"sim_ode.push\" kind: \"assumed\" }")},
                {"assumption[0].field", "write sim.push"});
  file = Changed("state_estimator {", "state_estimator { method: INVARIANT_EKF ");
  ExpectRefused({"run", file}, {Line(), "method", "leave it out"});
  // The scenario of a run that has been may have it: it is passed over.
  EXPECT_TRUE(LoggedScenario(ReadFile(file), file).has_sim());
  ExpectRefused({"run", StandScenario(), "--set", "state_estimator.method=INVARIANT_EKF"},
                {"--set state_estimator.method", "leave it out"});
  file = Changed("metric: \"violated_ticks\"", "metric: \"invariant_ekf_tilt_max\"");
  ExpectRefused({"run", file}, {Line(), "check[2].metric", "write estimator_tilt_max"});
}

TEST_F(BadInputTest, TheEngineIsOneThatThereIs) {
  ExpectRefused({"run", StandScenario(), "--set", "engine=od"},
                {"--set engine", "no engine 'od'", "ode"});
  ExpectRefused({"run", StandScenario(), "--world", "mujuco"},
                {"--world: engine", "no engine 'mujuco'", "mujoco"});
  ExpectRefused(
      {"run", StandScenario(), "--world", "mujoco", "--set", "mujoco.contact_time_constant=0.0005"},
      {"mujoco.contact_time_constant", "less than a step"});
  ExpectRefused({"run", StandScenario(), "--set", "ode.contact_cfm=0"},
                {"--set ode.contact_cfm", "greater than 0"});
  ExpectRefused({"run", StandScenario(), "--world", "mujoco", "--set", "ode.contact_cfm=1e-6"},
                {"--set ode.contact_cfm=1e-6", "engine is mujoco", "--world ode"});
  ExpectRefused({"run", StandScenario(), "--set", "mujoco.contact_softness=1e-6"},
                {"--set mujoco.contact_softness=1e-6", "engine is ode", "--world mujoco"});
  EXPECT_EQ(RunPoise({"run", StandScenario(), "--inline", "--set", "engine=ode", "--out",
                      folder_ / "run"})
                .exit_code,
            0);
}

TEST_F(BadInputTest, ValueSetOnTheCommandLineIsNamedAsSuch) {
  ExpectRefused({"run", StandScenario(), "--set", "redistributor.double_support.half_width=0"},
                {"--set redistributor.double_support.half_width"});
}

TEST_F(BadInputTest, GraphProblemsComeAllAtOnceWithLines) {
  const std::string graph = folder_ / "broken.pbtxt";
  std::ofstream(graph) << "name: \"broken\"\n"
                          "channel { name: \"A\" type: \"no_such_t\" }\n"
                          "channel { name: \"B\" type: \"robot_state_t\" }\n"
                          "component { name: \"nobody\" }\n";
  const ProgramResult result = RunPoise({"graph", "check", graph});
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_NE(result.output.find(graph + ":2"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("no_such_t"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find(graph + ":4"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("nobody"), std::string::npos) << result.output;
}

// What is odd is told before a run, too: by the check, of a sweep's first run.
TEST_F(BadInputTest, WhatIsOddIsToldBeforeARun) {
  const TestDeploy deploy;
  deploy.Scenario("odd",
                  "base: \"base/stand\" name: \"odd\" duration: 0.1\n"
                  "variant { name: \"late\" set: \"sim.push[0].start=5\" }\n"
                  "check { metric: \"push_peak\" }\n");
  const std::string late = "sim.push[0].start: 5 s is after the run's end, 0.1 s";
  const ProgramResult checked = RunPoise({"graph", "check", "odd"});
  EXPECT_EQ(checked.exit_code, 0) << checked.output;
  EXPECT_THAT(checked.output, HasSubstr("warning: variant late: " + late));
  EXPECT_THAT(checked.output, HasSubstr("good but for "));
  const ProgramResult swept =
      RunPoise({"sweep", "odd", "--variant", "late", "--vary", "sim.push[0].peak=20,40", "--quiet",
                "--out", folder_ / "sweep"});
  EXPECT_EQ(swept.exit_code, 0) << swept.output;
  EXPECT_THAT(swept.output, HasSubstr("warning: run 0: " + late));
}

TEST_F(BadInputTest, ARobotIsNotImportedBesideAnother) {
  const std::string maker = POISE_SOURCE_DIR "/deploy/robots/heron/heron.urdf";
  const auto import = [&](const std::string& name) {
    return std::vector<std::string>{"robot",           "import", maker, "--to",
                                    folder_ / "robot", "--name", name};
  };
  EXPECT_EQ(RunPoise(import("first")).exit_code, 0);
  ExpectUsageError(import("second"), {"--to", "first.pbtxt", "--force"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "robot/second.pbtxt"));
  std::vector<std::string> forced = import("second");
  forced.push_back("--force");
  EXPECT_EQ(RunPoise(forced).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "robot/first.pbtxt"));
}

TEST_F(BadInputTest, EveryScenarioOfTheHouseIsGood) {
  const std::filesystem::path folder = POISE_SOURCE_DIR "/deploy/scenarios";
  int checked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;  // base/: not to be run by themselves
    const ProgramResult result = RunPoise({"graph", "check", entry.path().string()});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    ++checked;
  }
  EXPECT_GT(checked, 0);
}

TEST_F(BadInputTest, CutOfALogNeedsTimesInOrder) {
  const std::string out = folder_ / "cut.lcm";
  for (const char* time : {"nan", "inf", "-2e9", "1e300", "soon"}) {
    ExpectUsageError({"log", "cut", "run.lcm", "--out", out, "--from", time}, {"--from", time});
    ExpectUsageError({"log", "cut", "run.lcm", "--out", out, "--to", time}, {"--to", time});
  }
  const std::string log = folder_ / "run.lcm";
  std::ofstream(log) << "no log";
  ExpectUsageError({"log", "cut", log, "--out", out, "--from", "6", "--to", "5"},
                   {"--from 6", "--to 5"});
  ExpectUsageError({"log", "cut", log, "--out", out, "--first-tick", "6", "--last-tick", "5"},
                   {"--first-tick 6", "--last-tick 5"});
}

TEST_F(BadInputTest, PageReplacesNoLogAndIsThereWholeOrNotAtAll) {
  const std::string run = folder_ / "run";
  const std::string log = run + "/run.lcm";
  ASSERT_EQ(RunPoise({"run", StandScenario(), "--inline", "--out", run}).exit_code, 0);
  const std::string bytes = ReadFile(log);
  const ProgramResult result = RunPoise({"report", run, "--html", log});
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_NE(result.output.find(log + ": is the log itself"), std::string::npos) << result.output;
  EXPECT_EQ(ReadFile(log), bytes);
  std::filesystem::copy(log, folder_ / "other.lcm");
  EXPECT_EQ(RunPoise({"report", run, "--html", folder_ / "other.lcm"}).exit_code, 2);
  EXPECT_EQ(ReadFile(folder_ / "other.lcm"), bytes);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "other.lcm.part"));
}

TEST_F(BadInputTest, ANumberThatIsNoneIsNamedWithItsFlag) {
  for (const char* const seed : {"99999999999999999999", "-1", "1.5", "abc"}) {
    ExpectUsageError({"run", StandScenario(), "--inline", "--seed", seed}, {"--seed", seed});
    ExpectUsageError({"run", StandScenario(), "--realtime", "--kill", "1", "--kill-seed", seed},
                     {"--kill-seed", seed});
    ExpectUsageError({"sweep", StandScenario(), "--vary", "seed=1:2:2", "--seed", seed},
                     {"--seed", seed});
  }
  ExpectUsageError({"sweep", StandScenario(), "--vary", "seed=1:2:2", "--world", "abc"},
                   {"--world: there is no engine 'abc'", "mujoco"});
  ExpectUsageError({"worlds", StandScenario(), "--range", "0:1"}, {"--range: is of a sweep"});
  for (const char* const flag : {"--inertia", "--damping", "--duration"}) {
    ExpectUsageError({"drives", "emulate", flag, "1e999"}, {flag, "1e999"});
    // Not a number passes every comparison of a range the wrong way round.
    ExpectUsageError({"drives", "emulate", flag, "nan"}, {flag, "nan"});
  }
  ExpectUsageError({"drives", "emulate", "--profile", "abc"}, {"'abc'", "elmo_gold"});
  ExpectUsageError({"run", "push", "--inline", "--set", "task_controller.com.kp=200"},
                   {"com.kd", "is not set, but com is"});
}

TEST_F(BadInputTest, ListsKeepToTheColumns) {
  setenv("COLUMNS", "60", 1);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"list", "components"}, {"list", "components", "hw_bridge"}}) {
    const ProgramResult result = RunPoise(command);
    EXPECT_EQ(result.exit_code, 0);
    std::stringstream lines(result.output);
    // Up to the settings, each of which begins with a line of its own, to be searched for.
    for (std::string line; std::getline(lines, line) && !line.empty();) {
      if (!line.starts_with("  ")) continue;  // a summary
      EXPECT_LE(line.size(), 60u) << line;
    }
  }
  const std::string bridge = RunPoise({"list", "components", "hw_bridge"}).output;
  EXPECT_THAT(bridge, HasSubstr("drive_feedback_t, unless"));
  EXPECT_THAT(bridge, HasSubstr("bus_status_t, where"));
  unsetenv("COLUMNS");
}

TEST_F(BadInputTest, HelpIsThereForEveryCommand) {
  for (const std::vector<std::string>& command : {std::vector<std::string>{},
                                                  {"run"},
                                                  {"matrix"},
                                                  {"report"},
                                                  {"compare"},
                                                  {"graph"},
                                                  {"graph", "check"},
                                                  {"list"},
                                                  {"doctor"},
                                                  {"estop"}}) {
    std::vector<std::string> arguments = command;
    arguments.push_back("--help");
    EXPECT_EQ(RunPoise(arguments).exit_code, 0);
  }
  EXPECT_EQ(RunPoise({"--version"}).exit_code, 0);
  EXPECT_EQ(RunPoise({"list"}).exit_code, 0);
}

}  // namespace
}  // namespace poise
