// Whatever ends a run, nothing is left behind and the message says what it was.
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

const std::vector<std::string> kComponents = {
    "sim",           "hw_bridge",       "state_estimator",
    "step_planner",  "task_controller", "contact_wrench_monitor",
    "redistributor", "recorder"};

/// The simulated robot's program is its engine's.
std::string ProgramOf(const std::string& component) {
  return component == "sim" ? "sim_ode" : component;
}

class SupervisionTest : public testing::Test {
 protected:
  /// A run long enough not to end by itself.
  PoiseProgram Start(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = {"run", StandScenario(), "--out",
                                          run_,  "--duration",    "600"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return PoiseProgram(arguments);
  }

  /// Ends the run that is under way with `signal` to the launcher.
  void ExpectEndBy(int signal, const char* name) {
    PoiseProgram program = Start();
    ASSERT_TRUE(WaitForLog(run_, kUnderWay));
    kill(program.pid(), signal);
    const ProgramResult result = program.Wait();
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_NE(result.output.find(std::string("interrupted (") + name), std::string::npos)
        << result.output;
    EXPECT_TRUE(ProcessesWith(run_).empty());
    // The log up to there is whole.
    const logging::RunRecord record = logging::ReadRun(run_ + "/run.lcm");
    EXPECT_GT(record.num_ticks, 10);
    EXPECT_EQ(record.damages, 0);
    EXPECT_FALSE(ReadSummary(run_)["passed"].get<bool>());
  }

  RunFolder folder_;
  std::string run_ = folder_ / "run";
};

TEST_F(SupervisionTest, EveryComponentIsAProcess) {
  PoiseProgram program = Start();
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  for (const std::string& component : kComponents) {
    EXPECT_GT(ComponentProcess(run_, ProgramOf(component)), 0) << component;
  }
  kill(program.pid(), SIGINT);
  program.Wait();
  EXPECT_TRUE(ProcessesWith(run_).empty());
}

TEST_F(SupervisionTest, CtrlCLeavesNothing) { ExpectEndBy(SIGINT, "Interrupt"); }

TEST_F(SupervisionTest, TermLeavesNothing) { ExpectEndBy(SIGTERM, "Terminated"); }

TEST_F(SupervisionTest, KilledLauncherLeavesNothing) {
  PoiseProgram program = Start();
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  kill(program.pid(), SIGKILL);
  program.Wait();
  EXPECT_TRUE(WaitUntil([&] { return ProcessesWith(run_).empty(); }));
}

TEST_F(SupervisionTest, DeathOfAnyProcessEndsTheRunNamingIt) {
  for (const std::string& component : kComponents) {
    run_ = folder_ / component;
    PoiseProgram program = Start();
    ASSERT_TRUE(WaitForLog(run_, kUnderWay));
    const pid_t pid = ComponentProcess(run_, ProgramOf(component));
    ASSERT_GT(pid, 0) << component;
    kill(pid, SIGKILL);
    const ProgramResult result = program.Wait();
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_NE(result.output.find(component + " was ended by signal 9 (Killed)"), std::string::npos)
        << result.output;
    EXPECT_NE(result.output.find(component + ".log"), std::string::npos) << result.output;
    EXPECT_TRUE(ProcessesWith(run_).empty()) << component;
  }
}

TEST_F(SupervisionTest, DeathOfASharedProcessEndsTheRunNamingIt) {
  PoiseProgram program = Start({"--hosted"});
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  EXPECT_LT(ComponentProcess(run_, "state_estimator"), 0);
  const pid_t pid = ComponentProcess(run_, "component_host");
  ASSERT_GT(pid, 0);
  kill(pid, SIGKILL);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("controller was ended by signal 9 (Killed)"), std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("controller.log"), std::string::npos) << result.output;
  EXPECT_TRUE(ProcessesWith(run_).empty());
}

TEST_F(SupervisionTest, StoppedProcessIsEndedToo) {
  PoiseProgram program = Start();
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  kill(ComponentProcess(run_, "task_controller"), SIGSTOP);  // deaf to STOP and SIGTERM
  kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_TRUE(ProcessesWith(run_).empty());
}

TEST_F(SupervisionTest, InlineRunEndsByCtrlC) {
  PoiseProgram program = Start({"--inline"});
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_NE(result.output.find("interrupted (Interrupt)"), std::string::npos) << result.output;
}

TEST_F(SupervisionTest, EmergencyStopIsConfirmedByTheBridge) {
  PoiseProgram program = Start({"--set", "duration=4"});
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  const ProgramResult stop = RunPoise({"estop", run_});
  EXPECT_EQ(stop.exit_code, 0) << stop.output;
  const ProgramResult result = program.Wait();  // the robot without torque falls
  EXPECT_EQ(result.exit_code, 1) << result.output;
  const logging::RunRecord record = logging::ReadRun(run_ + "/run.lcm");
  const bridge_status_t* last = record.bridge.at(record.num_ticks - 1);
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->state, bridge_status_t::STATE_ESTOP);
  EXPECT_EQ(last->reason, bridge_status_t::REASON_OPERATOR);
}

}  // namespace
}  // namespace poise
