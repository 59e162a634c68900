// Runs that crash, hang or are killed: they are made once more, named in every result, and count
// for nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>

#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class SweepFaultTest : public testing::Test {
 protected:
  SweepFaultTest() {
    setenv("POISE_PATH", FAULTY_MODULE, 1);
    std::ofstream(Out("faulty.pbtxt"))
        << "# proto-file: components/framework/graph.proto\n# proto-message: poise.Graph\n"
           "base: \"balance\" name: \"faulty\"\n"
           "channel { name: \"WATCHED\" type: \"external_push_t\" }\n"
           "component { name: \"faulty\" input { port: \"robot_state\" channel: \"ROBOT_STATE\" } "
           "output { port: \"watched\" channel: \"WATCHED\" } }\n";
    deploy_.Scenario("faulty", "base: \"base/stand\" name: \"faulty\" duration: 0.3 graph: \"" +
                                   Out("faulty.pbtxt") + "\"\ncheck { metric: \"push_peak\" }\n");
  }
  ~SweepFaultTest() override {
    for (const char* name : {"POISE_PATH", "POISE_TEST_FAULT", "POISE_TEST_FAULT_ONCE"}) {
      unsetenv(name);
    }
  }
  std::string Out(const std::string& name) const { return deploy_ / name; }
  static std::string Read(const std::string& folder, const char* file) {
    return ReadAll(fs::path(folder) / file);
  }
  /// A run in one process ends by `fault` with exit code 1, `words` and the log of what came
  /// before.
  void ExpectEnds(const std::string& way, const char* fault, const std::string& words) const {
    SCOPED_TRACE(way);
    setenv("POISE_TEST_FAULT", fault, 1);
    const std::string out = Out("run" + way);
    const ProgramResult result = RunPoise({"run", "faulty", way, "--out", out});
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_THAT(result.output, HasSubstr("faulty " + words));
    EXPECT_GT(fs::file_size(out + "/run.lcm"), 100'000u);
  }

  TestDeploy deploy_;
};

TEST_F(SweepFaultTest, ACrashIsNamedInEveryResult) {
  setenv("POISE_TEST_FAULT", "crash:100", 1);
  const std::string out = Out("out");
  const ProgramResult result =
      RunPoise({"sweep", "faulty", "--vary", "sim.push[0].peak=20,40", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_THAT(result.output, HasSubstr("it is made once more"));
  const std::vector<CsvRow> rows = ReadCsv(out + "/table.csv");
  ASSERT_EQ(rows.size(), 2u);
  for (const CsvRow& row : rows) {
    EXPECT_EQ(row.at("outcome"), "crashed");
    EXPECT_EQ(row.at("component"), "faulty");
    EXPECT_EQ(row.at("stage"), "watch");
    EXPECT_EQ(std::stod(row.at("ended_at")), 0.2);  // tick 100
    EXPECT_THAT(row.at("reason"), HasSubstr("signal 11"));
  }
  const std::string charts = Read(out, "charts.json");
  EXPECT_THAT(charts, HasSubstr("2 runs do not tell whether the robot stood"));
  EXPECT_THAT(charts, HasSubstr("crashed in faulty, stage watch, at 0.200 s"));
  EXPECT_THAT(charts, Not(HasSubstr("\"outcome\":\"fell\"")));
}

// Neither is a signal: an exception that a stage lets out, and exit(), of whatever code.
TEST_F(SweepFaultTest, AnExceptionAndAnExitAreCrashesOfTheirStage) {
  for (const auto& [fault, reason] :
       {std::pair{"throw:100", "its stage threw: no reason"},
        std::pair{"exit:100", "its stage ended the program with exit code 0"}}) {
    SCOPED_TRACE(fault);
    setenv("POISE_TEST_FAULT", fault, 1);
    const std::string out = Out(std::string("out_") + fault);
    const ProgramResult result =
        RunPoise({"sweep", "faulty", "--vary", "duration=0.1,0.3", "--jobs", "1", "--out", out});
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_THAT(result.output,
                HasSubstr(std::string("crashed in faulty, stage watch, at 0.200 s: ") + reason +
                          "; it is made once more"));
    const std::vector<CsvRow> rows = ReadCsv(out + "/table.csv");
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[0].at("outcome"), "stands");
    EXPECT_EQ(rows[1].at("outcome"), "crashed");
    EXPECT_EQ(rows[1].at("component"), "faulty");
    EXPECT_EQ(rows[1].at("stage"), "watch");
    EXPECT_EQ(std::stod(rows[1].at("ended_at")), 0.2);
    EXPECT_EQ(rows[1].at("reason"), reason);
    for (const char* file : {"results.jsonl", "charts.json", "charts.html"}) {
      EXPECT_THAT(Read(out, file), HasSubstr(reason)) << file;
    }

    const std::string limit = Out(std::string("limit_") + fault);
    const ProgramResult sought =
        RunPoise({"limit", "faulty", "--field", "sim.push[0].peak", "--min", "10", "--max", "20",
                  "--samples", "2", "--out", limit});
    EXPECT_EQ(sought.exit_code, 1) << sought.output;
    EXPECT_THAT(sought.output, HasSubstr(reason));
    EXPECT_EQ(ReadCsv(limit + "/limits.csv").at(0).at("sim.push[0].peak"), "");
  }
}

// That a run had not fallen before it was stopped says nothing.
TEST_F(SweepFaultTest, ARunThatWasStoppedHasNoMetrics) {
  setenv("POISE_TEST_FAULT", "nan:100", 1);
  const ProgramResult result =
      RunPoise({"sweep", "faulty", "--vary", "duration=0.1,0.3", "--column", "fallen", "--column",
                "push_peak", "--out", Out("out")});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  const std::vector<CsvRow> rows = ReadCsv(Out("out") + "/table.csv");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("outcome"), "stands");
  EXPECT_EQ(rows[0].at("fallen"), "0");
  EXPECT_EQ(rows[1].at("outcome"), "stopped");
  EXPECT_THAT(rows[1].at("reason"), HasSubstr("not finite"));
  EXPECT_EQ(rows[1].at("fallen"), "");
  EXPECT_EQ(rows[1].at("push_peak"), "");
}

TEST_F(SweepFaultTest, WhatCrashesOnceOnlyIsMadeOnceMore) {
  const std::vector<std::string> sweep = {"sweep",  "faulty", "--vary", "sim.push[0].peak=20,40",
                                          "--jobs", "1",      "--out"};
  const auto run = [&](const std::string& out) {
    std::vector<std::string> arguments = sweep;
    arguments.push_back(Out(out));
    return RunPoise(arguments);
  };
  EXPECT_EQ(run("good").exit_code, 0);
  setenv("POISE_TEST_FAULT", "crash:100", 1);
  setenv("POISE_TEST_FAULT_ONCE", Out("once").c_str(), 1);
  const ProgramResult result = run("once_more");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("run 0: crashed in faulty, stage watch, at 0.200 s"));
  EXPECT_EQ(Read(Out("once_more"), "table.csv"), Read(Out("good"), "table.csv"));
}

TEST_F(SweepFaultTest, ResumeTriesAgainWhatDidNotTell) {
  std::vector<std::string> sweep = {"sweep", "faulty",  "--vary", "sim.push[0].peak=20,40",
                                    "--out", Out("out")};
  setenv("POISE_TEST_FAULT", "crash:100", 1);
  EXPECT_EQ(RunPoise(sweep).exit_code, 1);
  unsetenv("POISE_TEST_FAULT");
  sweep.push_back("--resume");
  const ProgramResult result = RunPoise(sweep);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const CsvRow& row : ReadCsv(Out("out") + "/table.csv")) {
    EXPECT_EQ(row.at("outcome"), "stands");
  }
}

// From some force on the component crashes, long before the robot would fall.
TEST_F(SweepFaultTest, ALimitOverACrashIsNotKnown) {
  setenv("POISE_TEST_FAULT", "slip:0.1", 1);
  const std::string out = Out("out");
  const ProgramResult result = RunPoise({"limit", "faulty", "--field", "sim.push[0].peak", "--min",
                                         "10", "--max", "910", "--samples", "4", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  const std::vector<CsvRow> limits = ReadCsv(out + "/limits.csv");
  ASSERT_EQ(limits.size(), 1u);
  for (const char* name : {"sim.push[0].peak", "fails_at", "impulse", "monotone"}) {
    EXPECT_EQ(limits[0].at(name), "") << name;
  }
  EXPECT_NE(limits[0].at("untold"), "0");
  EXPECT_THAT(result.output, HasSubstr("not known"));
  EXPECT_THAT(result.output, HasSubstr("crashed in faulty, stage watch"));
  EXPECT_THAT(Read(out, "charts.json"), HasSubstr("\"outcome\":\"crashed\""));
}

// Each takes the 20 s after which a run hangs, twice where it is made once more.
TEST_F(SweepFaultTest, AStageThatLoopsForEverIsNamedAndTheOthersGoOn) {
  setenv("POISE_TEST_FAULT", "hang:100", 1);
  const std::string out = Out("out");
  const ProgramResult result =
      RunPoise({"sweep", "faulty", "--vary", "duration=0.1,0.3", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  const std::vector<CsvRow> rows = ReadCsv(out + "/table.csv");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("outcome"), "stands");
  EXPECT_EQ(rows[1].at("outcome"), "hung");
  EXPECT_EQ(rows[1].at("component"), "faulty");
  EXPECT_EQ(rows[1].at("stage"), "watch");
  EXPECT_EQ(std::stod(rows[1].at("ended_at")), 0.2);
}

TEST_F(SweepFaultTest, ARunInOneProcessThatHangsEndsAndNamesTheStage) {
  for (const char* way : {"--inline", "--interactive"}) {
    ExpectEnds(way, "hang:100", "hangs: its stage watch has not returned for 20 s, at tick 100");
  }
}

TEST_F(SweepFaultTest, ARunInOneProcessThatAStageEndsFailsAndNamesTheStage) {
  for (const char* way : {"--inline", "--interactive"}) {
    ExpectEnds(way, "exit:100", "ends the run: its stage watch called exit(0), at tick 100");
  }
}

TEST_F(SweepFaultTest, AConfigureThatHangsIsNamed) {
  setenv("POISE_TEST_FAULT", "hang:-1", 1);
  const ProgramResult result = RunPoise({"sweep", "faulty", "--vary", "duration=0.1,0.3"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_THAT(result.output, HasSubstr("faulty hangs: its Configure has not returned for 30 s"));
}

TEST_F(SweepFaultTest, AReplayThatHangsEndsAndNamesTheStage) {
  ASSERT_EQ(RunPoise({"run", "faulty", "--inline", "--quiet", "--out", Out("run")}).exit_code, 0);
  const std::vector<std::string> replay{"replay", Out("run"), "--component", "faulty"};
  EXPECT_EQ(RunPoise(replay).exit_code, 0);
  setenv("POISE_TEST_FAULT", "hang:100", 1);
  const ProgramResult result = RunPoise(replay);
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_THAT(result.output,
              HasSubstr("faulty hangs: its stage watch has not returned for 20 s, at tick 100"));
}

// The one that does not answer is named, not the others, which wait for it.
TEST_F(SweepFaultTest, AProcessThatStandsStillIsTheOneThatIsNamed) {
  unsetenv("POISE_PATH");
  PoiseProgram program({"run", StandScenario(), "--duration", "1000", "--out", Out("run")});
  ASSERT_TRUE(WaitForLog(Out("run"), kUnderWay)) << program.Wait().output;
  kill(ComponentProcess(Out("run"), "task_controller"), SIGSTOP);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("no tick for 20 s: task_controller is waited for"));
}

}  // namespace
}  // namespace poise
