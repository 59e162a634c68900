// Commands without a run find what goes on, wherever it was started to write.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <set>

#include "logging/run_record.h"
#include "tests/graph/current_folder.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Runs of this test alone are known to the programs that this process starts.
class OwnRegistry {
 public:
  OwnRegistry() {
    setenv("POISE_RUNTIME_DIR", (folder_ / "registry").c_str(), 1);
    setenv("POISE_RUNS_DIR", (folder_ / "runs").c_str(), 1);
  }
  ~OwnRegistry() {
    unsetenv("POISE_RUNTIME_DIR");
    unsetenv("POISE_RUNS_DIR");
  }
  OwnRegistry(const OwnRegistry&) = delete;
  OwnRegistry& operator=(const OwnRegistry&) = delete;

 private:
  RunFolder folder_;
};

class RunningRunsTest : public ::testing::Test {
 protected:
  /// A run that goes on until its end is asked for.
  std::unique_ptr<PoiseProgram> Start(const std::string& run) {
    auto program = std::make_unique<PoiseProgram>(std::vector<std::string>{
        "run", StandScenario(), "--realtime", "--duration", "300", "--quiet", "--out", run});
    EXPECT_TRUE(WaitForLog(run, kUnderWay));
    return program;
  }
  static std::string Whole(const std::string& run) { return fs::canonical(run).string(); }
  static int8_t LastState(const std::string& run) {
    const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
    const bridge_status_t* last = nullptr;
    for (int64_t t = record.num_ticks; t-- > 0 && last == nullptr;) last = record.bridge.at(t);
    return last != nullptr ? last->state : int8_t{-1};
  }

  /// N, ahead, all that the log's truth has.
  static std::set<double> Pushes(const std::string& run) {
    const logging::RunRecord record = logging::ReadRun(run + "/run.lcm");
    std::set<double> forces;
    for (int64_t t = 0; t < record.num_ticks; ++t) {
      if (const ground_truth_t* const truth = record.truth.at(t)) {
        forces.insert(truth->push_force[0]);
      }
    }
    return forces;
  }

  OwnRegistry registry;
  RunFolder folder;
};

TEST_F(RunningRunsTest, TheOnlyOneIsMeantAndADeadOneForgotten) {
  ExpectUsageError({"estop"}, {"no run is going on; start one with poise run"});
  ExpectUsageError({"top", "--once"}, {"no run is going on"});
  const std::string run = folder / "elsewhere";
  const std::unique_ptr<PoiseProgram> program = Start(run);
  ExpectUsageError({"report", run, "--no-html"}, {Whole(run), "this run still goes on"});
  ExpectUsageError({"log", "check", run + "/run.lcm"}, {Whole(run), "this run still goes on"});
  const ProgramResult top = RunPoise({"top", "--once", "--interval", "1"});
  EXPECT_EQ(top.exit_code, 0) << top.output;
  EXPECT_THAT(top.output, HasSubstr(Whole(run)));
  const ProgramResult echo = RunPoise({"echo", "ROBOT_STATE", "tick", "--count", "3"});
  EXPECT_EQ(echo.exit_code, 0) << echo.output;
  EXPECT_THAT(RunPoise({"list", "runs"}).output,
              HasSubstr(Whole(run) + "  (stand, robot dyros_legs, since "));
  EXPECT_EQ(RunPoise({"list", "runs", "--folders"}).output, Whole(run) + "\n");

  kill(program->pid(), SIGKILL);
  program->Wait();
  EXPECT_TRUE(WaitUntil([&] { return RunPoise({"list", "runs", "--folders"}).output.empty(); }));
  ExpectUsageError({"top", "--once"},
                   {"no run is going on; the latest has ended: poise log info " + Whole(run)});
  ExpectUsageError({"view"}, {"no run is going on; the latest has ended: poise report"});
  ExpectUsageError({"estop", "--reset"}, {"no run is going on"});
  // Nothing can be pushed in a run that has ended.
  ExpectUsageError({"push", "--force", "1,0,0"}, {"no run is going on; start one with poise run"});
}

TEST_F(RunningRunsTest, AnEmergencyStopWithoutARunStopsEveryOne) {
  const std::string a = folder / "a";
  const std::string b = folder / "b";
  const std::unique_ptr<PoiseProgram> first = Start(a);
  const std::unique_ptr<PoiseProgram> second = Start(b);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"top", "--once"}, {"echo", "ROBOT_STATE"}, {"view"}}) {
    const ProgramResult result = RunPoise(command);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_THAT(result.output, HasSubstr("several runs are going on; name one:"));
    EXPECT_THAT(result.output, HasSubstr(Whole(a)));
    EXPECT_THAT(result.output, HasSubstr(Whole(b)));
  }
  const ProgramResult all = RunPoise({"estop"});
  EXPECT_EQ(all.exit_code, 0) << all.output;
  for (const std::string& run : {a, b}) {
    EXPECT_THAT(all.output, HasSubstr(Whole(run) + "): the bridge has stopped the robot"));
  }
  first->Wait();  // the robot without torque falls
  second->Wait();
  EXPECT_EQ(LastState(a), bridge_status_t::STATE_ESTOP);
  EXPECT_EQ(LastState(b), bridge_status_t::STATE_ESTOP);
}

TEST_F(RunningRunsTest, AnActWithoutARunIsForTheOnlyOne) {
  const std::string a = folder / "a";
  const std::string b = folder / "b";
  const std::unique_ptr<PoiseProgram> first = Start(a);
  {
    const std::unique_ptr<PoiseProgram> second = Start(b);
    for (const std::vector<std::string>& command : {std::vector<std::string>{"set", "--list"},
                                                    {"push", "--force", "-20,0,0"},
                                                    {"set", "redistributor.eta_min=0.1"},
                                                    {"step"},
                                                    {"walk", "--stop"}}) {
      const ProgramResult result = RunPoise(command);
      EXPECT_EQ(result.exit_code, 2) << result.output;
      EXPECT_THAT(result.output, HasSubstr("several runs are going on; name one:"));
      EXPECT_THAT(result.output, HasSubstr(Whole(a) + "  (stand, robot dyros_legs, since "));
      EXPECT_THAT(result.output, HasSubstr(Whole(b) + "  (stand, robot dyros_legs, since "));
      EXPECT_THAT(result.output, ContainsRegex("as in: poise " + command[0] + " --run [ab]"));
    }
    const ProgramResult named =
        RunPoise({"push", "--run", "b", "--force", "-20,0,0", "--duration", "0.02"});
    EXPECT_EQ(named.exit_code, 0) << named.output;
    // A name stops one; the other goes on, and is then the only one.
    const ProgramResult stop = RunPoise({"estop", "b"});
    EXPECT_EQ(stop.exit_code, 0) << stop.output;
    EXPECT_THAT(stop.output, HasSubstr(Whole(b) + "): the bridge has stopped the robot"));
    EXPECT_THAT(stop.output, Not(HasSubstr(Whole(a))));
    second->Wait();
  }
  const ProgramResult push = RunPoise({"push", "--force", "-30,0,0", "--duration", "0.02"});
  EXPECT_EQ(push.exit_code, 0) << push.output;
  EXPECT_THAT(push.output,
              HasSubstr("the run: " + Whole(a) + "  (stand, robot dyros_legs, since "));
  EXPECT_THAT(push.output, HasSubstr("push of 30 N for 0.02 s: from tick "));
  const ProgramResult ended = RunPoise({"push", "--run", b, "--force", "-20,0,0"});
  EXPECT_EQ(ended.exit_code, 1) << ended.output;
  EXPECT_THAT(ended.output, HasSubstr("this run has ended"));
  const ProgramResult reset = RunPoise({"estop", b, "--reset"});
  EXPECT_EQ(reset.exit_code, 1) << reset.output;
  EXPECT_THAT(reset.output, HasSubstr("this run has ended"));
  kill(first->pid(), SIGINT);
  first->Wait();
  // What was refused or meant for b has not reached a: its truth knows the last push alone.
  EXPECT_EQ(Pushes(a), (std::set<double>{-30, 0}));
  EXPECT_EQ(Pushes(b), (std::set<double>{-20, 0}));
}

/// Bytes of a run's files, of its reference's as well.
int64_t Size(const fs::path& dir) {
  int64_t size = 0;
  for (const auto& entry : fs::recursive_directory_iterator(dir)) {
    if (entry.is_regular_file()) size += static_cast<int64_t>(entry.file_size());
  }
  return size;
}

/// Lets a run's record say that it began then.
void Date(const std::string& run, const std::string& started_at) {
  nlohmann::json summary = ReadSummary(run);
  summary["started_at"] = started_at;
  std::ofstream(run + "/summary.json") << summary;
}

TEST_F(RunningRunsTest, PastRunsAreListedFromTheirRecordsAndTheOldOnesGo) {
  ASSERT_NE(std::freopen("/dev/null", "r", stdin), nullptr);  // there is nobody to ask
  const auto listed = [] {
    return nlohmann::json::parse(RunPoise({"list", "runs", "--json"}).output);
  };
  const auto run = [](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {"run", StandScenario(), "--inline", "--quiet"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    EXPECT_NE(RunPoise(arguments).exit_code, 2);
  };
  EXPECT_TRUE(listed().empty());
  run({"--duration", "0.1"});
  const std::string first = listed()[0]["folder"];
  const fs::path runs = fs::path(first).parent_path();
  run({"--set", "task_controller.com.kp=190", "--without", "balancing", "--seed", "7"});
  run({StandScenario(), "--duration", "0.1"});  // a folder of two
  ASSERT_EQ(listed().size(), 4u);
  std::string changed;
  for (const nlohmann::json& one : listed()) {
    const std::string dir = one["folder"];
    const nlohmann::json summary = ReadSummary(dir);
    EXPECT_EQ(one["started_at"], summary["started_at"]);
    EXPECT_EQ(one["scenario"], "stand");
    EXPECT_EQ(one["robot"], "dyros_legs");
    EXPECT_EQ(one["bytes"], Size(dir));
    const std::string verdict = summary["passed"].get<bool>() ? "passed: " : "FAILED: ";
    EXPECT_THAT(one["outcome"].get<std::string>(), StartsWith(verdict));
    if (one["flags"] == nlohmann::json::array({"--duration 0.1"})) continue;
    EXPECT_EQ(one["flags"],
              nlohmann::json::array(
                  {"--without balancing", "--set task_controller.com.kp=190", "--seed 7"}));
    changed = dir;
  }
  Date(first, "2020-01-01T00:00:00Z");
  std::string several;
  for (const nlohmann::json& one : listed()) {
    const fs::path dir = one["folder"].get<std::string>();
    if (dir.parent_path() == runs) continue;
    several = dir.parent_path().string();
    Date(dir.string(), "2021-01-01T00:00:00Z");
  }
  EXPECT_EQ(listed()[0]["folder"], changed);
  EXPECT_EQ(listed()[3]["folder"], first);

  // What no run has written, and what only looks like one.
  std::ofstream(first + "/mine.txt") << "notes";
  fs::create_directory(runs / "other");
  std::ofstream(runs / "other/run_spec.pbtxt") << "nonsense";
  const ProgramResult shown = RunPoise({"runs", "prune", "--keep", "1"});
  EXPECT_EQ(shown.exit_code, 0) << shown.output;
  EXPECT_THAT(shown.output, HasSubstr("nothing is deleted without --yes"));
  EXPECT_THAT(RunPoise({"runs", "prune", "--keep", "0", "--days", "36500", "--yes"}).output,
              HasSubstr("no run in "));
  EXPECT_EQ(listed().size(), 4u);
  const ProgramResult one = RunPoise({"runs", "prune", "--keep", "2", "--yes"});
  EXPECT_EQ(one.exit_code, 0) << one.output;
  EXPECT_THAT(one.output, HasSubstr("deleted " + first + ", "));
  EXPECT_THAT(one.output, ContainsRegex("what no run has written stays\n[0-9.]+ .?B freed\n$"));
  EXPECT_EQ(listed().size(), 3u);
  EXPECT_EQ(ReadAll(first + "/mine.txt"), "notes");
  EXPECT_EQ(Size(first), 5);

  // A run in progress stays, whatever is asked for.
  PoiseProgram going({"run", StandScenario(), "--inline", "--realtime", "--duration", "300"});
  ASSERT_TRUE(WaitUntil([&] { return listed().size() == 4; }));
  EXPECT_EQ(listed()[0]["outcome"], "goes on");
  EXPECT_EQ(RunPoise({"runs", "prune", "--keep", "0", "--yes"}).exit_code, 0);
  ASSERT_EQ(listed().size(), 1u);
  EXPECT_EQ(listed()[0]["outcome"], "goes on");
  EXPECT_FALSE(fs::exists(changed));
  EXPECT_FALSE(fs::exists(several));
  EXPECT_EQ(ReadAll(runs / "other/run_spec.pbtxt"), "nonsense");
  kill(going.pid(), SIGINT);
  going.Wait();
}

TEST_F(RunningRunsTest, ARunInsideOneProcessIsSaidToHaveNoBridge) {
  PoiseProgram program({"run", StandScenario(), "--inline", "--realtime", "--duration", "300",
                        "--quiet", "--out", folder / "inside"});
  ASSERT_TRUE(WaitForLog(folder / "inside", kUnderWay));
  const ProgramResult stop = RunPoise({"estop"});
  EXPECT_EQ(stop.exit_code, 1) << stop.output;
  EXPECT_THAT(stop.output, HasSubstr("inside one process"));
  ExpectUsageError({"top", "--once"}, {"inside one process"});
  kill(program.pid(), SIGINT);
  program.Wait();
}

TEST_F(RunningRunsTest, ARegistryThatCannotBeWrittenFailsNoRun) {
  setenv("POISE_RUNTIME_DIR", "/proc/poise", 1);
  const ProgramResult result =
      RunPoise({"run", StandScenario(), "--inline", "--quiet", "--out", folder / "run"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output, HasSubstr("warning: this run cannot be registered"));
}

/// A program in a folder that is no checkout.
class ElsewhereTest : public ::testing::Test {
 protected:
  ElsewhereTest() : here(fs::path(folder / "")) { unsetenv("POISE_RUNS_DIR"); }
  OwnRegistry registry;
  RunFolder folder;
  CurrentFolder here;
};

TEST_F(ElsewhereTest, RunsGoIntoTheCurrentFolder) {
  const ProgramResult none = RunPoise({"report", "--no-html"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.output,
              HasSubstr("there is no run in " + (fs::current_path() / "runs").string()));
  ASSERT_EQ(RunPoise({"run", StandScenario(), "--inline", "--quiet"}).exit_code, 0);
  EXPECT_TRUE(fs::exists("runs/latest/run.lcm"));
  EXPECT_EQ(RunPoise({"report", "--no-html"}).exit_code, 0);
  fs::create_directory("deeper");
  const CurrentFolder deeper("deeper");
  EXPECT_EQ(RunPoise({"report", "--no-html"}).exit_code, 2);
}

TEST_F(ElsewhereTest, RunsOfACheckoutGoBesideItsDeployFolder) {
  fs::create_directories("checkout/tests");
  fs::create_directory("checkout/deploy");
  fs::copy(POISE_SOURCE_DIR "/deploy/robots", "checkout/deploy/robots",
           fs::copy_options::recursive);
  fs::copy(POISE_SOURCE_DIR "/deploy/graphs", "checkout/deploy/graphs",
           fs::copy_options::recursive);
  setenv("POISE_DEPLOY_DIR", fs::absolute("checkout/deploy").c_str(), 1);
  {
    const CurrentFolder within("checkout/tests");
    EXPECT_EQ(RunPoise({"run", StandScenario(), "--inline", "--quiet"}).exit_code, 0);
  }
  unsetenv("POISE_DEPLOY_DIR");
  EXPECT_TRUE(fs::exists("checkout/runs/latest/run.lcm"));
  EXPECT_FALSE(fs::exists("checkout/tests/runs"));
}

TEST_F(ElsewhereTest, AFolderThatCannotBeWrittenIsSaid) {
  std::ofstream("runs") << "a file";
  ExpectUsageError({"run", StandScenario(), "--inline"},
                   {fs::current_path().string() + "/runs", "cannot be made", "--out"});
}

}  // namespace
}  // namespace poise
