// Watching a run in progress from the terminal: it is shown as it is, and not disturbed.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::vector<std::string> Words(const std::string& line, char separator) {
  std::vector<std::string> words;
  std::istringstream in(line);
  for (std::string word; std::getline(in, word, separator);) {
    if (!word.empty()) words.push_back(word);
  }
  return words;
}

/// The words of the line that begins with `name`.
std::vector<std::string> RowOf(const std::string& view, const std::string& name) {
  for (const std::string& line : Lines(view)) {
    if (line.starts_with(name + " ")) return Words(line, ' ');
  }
  return {};
}

bool HasSocket(pid_t pid) {
  std::error_code error;
  for (const auto& fd : fs::directory_iterator("/proc/" + std::to_string(pid) + "/fd", error)) {
    if (fs::read_symlink(fd.path(), error).string().starts_with("socket:")) return true;
  }
  return false;
}

/// A run paced by the wall clock that goes on until its end is asked for.
class WatchTest : public ::testing::Test {
 protected:
  WatchTest() { EXPECT_TRUE(WaitForLog(run, kUnderWay)); }

  /// Ends it as Ctrl-C does, and reads its log.
  logging::RunRecord End() {
    kill(program.pid(), SIGINT);
    program.Wait();
    return logging::ReadRun(run + "/run.lcm");
  }

  RunFolder folder;
  std::string run = folder / "run";
  PoiseProgram program{
      {"run", StandScenario(), "--realtime", "--duration", "300", "--quiet", "--out", run}};
};

TEST_F(WatchTest, TopShowsEveryProcessAndChannel) {
  setenv("COLUMNS", "200", 1);  // a line each
  const ProgramResult top = RunPoise({"top", run, "--once", "--interval", "2"});
  unsetenv("COLUMNS");
  ASSERT_EQ(top.exit_code, 0) << top.output;
  EXPECT_EQ(top.output.find('\x1b'), std::string::npos);
  const logging::RunRecord record = End();
  for (const auto& [name, health] : record.health) {
    const std::vector<std::string> row = RowOf(top.output, name);
    ASSERT_EQ(row.size(), 14u) << name << " in\n" << top.output;
    EXPECT_EQ(row[1], "running");
    // A moment of this run, which its last report may still be.
    EXPECT_GT(std::stoll(row[11]), 0);
    EXPECT_LE(std::stoll(row[11]), health.tick);
    EXPECT_GT(std::stod(row[2]), 0);  // ticks/s
    EXPECT_EQ(row[6], "0");           // refused
  }
  for (const Channel& channel : record.spec.graph().channel()) {
    const std::vector<std::string> row = RowOf(top.output, channel.name());
    ASSERT_GE(row.size(), 8u) << channel.name() << " in\n" << top.output;
    EXPECT_EQ(row.back(), channel.type());
    const std::string& tick = row[row.size() - 2];
    if (channel.external()) {
      EXPECT_EQ(tick, "-");
      continue;
    }
    EXPECT_GT(std::stoll(tick), 0);
    EXPECT_LT(std::stoll(tick), record.num_ticks);
    EXPECT_GT(std::stod(row[1]), 0);  // messages/s
  }
}

TEST_F(WatchTest, EchoShowsTheMessagesThatTheLogGets) {
  const ProgramResult live = RunPoise({"echo", "ROBOT_STATE", "base_position", "joint_position[3]",
                                       "--csv", "--count", "50", "--run", run});
  ASSERT_EQ(live.exit_code, 0) << live.output;
  const logging::RunRecord record = End();
  const std::vector<std::string> lines = Lines(live.output);
  ASSERT_GE(lines.size(), 51u) << live.output;
  const std::string joint = "joint_position[" + record.robot.joints()[3].name + "]";
  EXPECT_EQ(lines[0], "tick,base_position[0],base_position[1],base_position[2]," + joint);
  int64_t before = -1;
  for (size_t i = 1; i <= 50; ++i) {
    const std::vector<std::string> cells = Words(lines[i], ',');
    ASSERT_EQ(cells.size(), 5u) << lines[i];
    const int64_t tick = std::stoll(cells[0]);
    EXPECT_GT(tick, before);
    before = tick;
    const robot_state_t* state = record.state.at(tick);
    ASSERT_NE(state, nullptr);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(std::strtod(cells[k + 1].c_str(), nullptr), state->base_position[k]);
    }
    EXPECT_EQ(std::strtod(cells[4].c_str(), nullptr), state->joint_position[3]);
  }
  // The log says the same of these ticks.
  const ProgramResult logged =
      RunPoise({"echo", "ROBOT_STATE", "base_position", joint, "--csv", "--log", run});
  EXPECT_EQ(logged.exit_code, 0);
  for (size_t i = 0; i <= 50; ++i) EXPECT_THAT(logged.output, HasSubstr(lines[i] + "\n"));
  int64_t states = 0;  // in real time not of every tick
  for (int64_t t = 0; t < record.num_ticks; ++t) states += record.state.at(t) != nullptr ? 1 : 0;
  EXPECT_EQ(Lines(logged.output).size(), static_cast<size_t>(states) + 1);
}

TEST_F(WatchTest, EchoEndsWithTheRun) {
  PoiseProgram echo({"echo", "JOINT_COMMAND", "tick", "--rate", "20", "--run", run});
  EXPECT_TRUE(WaitUntil([&] { return HasSocket(echo.pid()); }));
  // The recorder looks for listeners every 20 ms, and the run must not end before echo's next line.
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(WaitForLog(run, fs::file_size(run + "/run.lcm") + kUnderWay));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const logging::RunRecord record = End();
  const ProgramResult result = echo.Wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr("has ended"));
  EXPECT_THAT(result.output, HasSubstr("tick="));
}

TEST_F(WatchTest, UnknownChannelsAndFieldsAreUsageErrors) {
  ExpectUsageError({"echo", "ROBOT_STAET", "--run", run},
                   {"ROBOT_STAET", "did you mean ROBOT_STATE"});
  ExpectUsageError({"echo", "ROBOT_STATE", "base_positon", "--run", run},
                   {"robot_state_t has no field 'base_positon'; did you mean base_position?"});
  ExpectUsageError({"echo", "ROBOT_STATE", "base_position[3]", "--run", run},
                   {"base_position is an array of 3"});
  ExpectUsageError({"echo", "JOINT_COMMAND", "torque[right_knee_pich]", "--run", run},
                   {"torque has no element 'right_knee_pich'; did you mean right_knee_pitch"});
  ExpectUsageError({"echo", "JOINT_COMMAND", "foot_wrench[lef]", "--run", run},
                   {"foot_wrench has no element 'lef'; did you mean left?"});
  ExpectUsageError({"echo", "HEALTH_SIM", "stat", "--run", run}, {"did you mean state"});
  ExpectUsageError({"top", run}, {"stdout is no terminal", "--once"});
}

TEST(WatchEndedRunTest, AnEndedRunIsReadFromItsLog) {
  const RunFolder folder;
  const std::string run = folder / "run";
  ASSERT_EQ(RunPoise({"run", StandScenario(), "--inline", "--quiet", "--out", run}).exit_code, 0);
  ExpectUsageError({"top", run}, {"has ended", "poise log info"});
  ExpectUsageError({"top", run, "--once"}, {"has ended", "poise log info"});
  ExpectUsageError({"top", run + "/run.lcm"}, {"poise log info"});
  ExpectUsageError({"top", run + "/none"}, {"no such run folder"});
  ExpectUsageError({"top", run, "--interval", "nan"}, {"--interval: nan: must be in [0.1, 60]"});
  ExpectUsageError({"echo", "ROBOT_STATE", "--run", run}, {"has ended", "--log"});
  ExpectUsageError({"echo", "ROBOT_STATE", "--run", run, "--log", run}, {"--log"});
  ExpectUsageError({"echo", "ROBOT_STAET", "--log", run}, {"did you mean ROBOT_STATE"});
  std::ofstream(folder / "empty.lcm").flush();
  ExpectUsageError({"echo", "ROBOT_STATE", "--log", folder / "empty.lcm"}, {"no message at all"});
  ExpectUsageError({"echo", "ROBOT_STATE", "tik", "--log", run}, {"did you mean tick"});
  ExpectUsageError({"echo", "ROBOT_STATE", "--log", run, "--rate", "0"}, {"--rate"});
  ExpectUsageError({"echo", "ROBOT_STATE", "--log", run, "--count", "0"}, {"--count"});

  const ProgramResult whole = RunPoise({"echo", "BALANCE_TORQUE", "--log", run, "--count", "1"});
  EXPECT_EQ(whole.exit_code, 0);
  EXPECT_THAT(whole.output, HasSubstr("BALANCE_TORQUE  balance_torque_t  tick 0  0.000000 s\n"));
  EXPECT_THAT(whole.output, HasSubstr("\n  num_joints                  12\n"));
  // Joints as rows, in the order of the robot's.
  EXPECT_THAT(whole.output, HasSubstr("torque  balance_torque\n  right_hip_yaw "));
  EXPECT_THAT(whole.output, HasSubstr("foot_wrench[left].force "));
  const ProgramResult foot = RunPoise(
      {"echo", "JOINT_COMMAND", "foot_wrench[left_foot].force[2]", "--log", run, "--count", "1"});
  EXPECT_THAT(foot.output, HasSubstr("tick=0 foot_wrench[left].force[2]=-"));
  // 200 ticks of 2 ms thinned out to 50 Hz: every tenth.
  const ProgramResult thin =
      RunPoise({"echo", "ROBOT_STATE", "utime", "--log", run, "--rate", "50"});
  EXPECT_EQ(thin.exit_code, 0);
  std::string expected;
  for (int i = 0; i < 20; ++i) {
    expected += "tick=" + std::to_string(10 * i) + " utime=" + std::to_string(20'000 * i) + "\n";
  }
  EXPECT_EQ(thin.output, expected);
}

TEST_F(WatchTest, CtrlCEndsEchoWhoseReaderDoesNotRead) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  const pid_t echo = fork();
  if (echo == 0) {
    dup2(ends[1], STDOUT_FILENO);
    execl(POISE_BIN_DIR "/poise", "poise", "echo", "GROUND_TRUTH", "--run", run.c_str(), nullptr);
    _exit(127);
  }
  // Full: it waits inside its write.
  const auto full = [&] {
    pollfd end{ends[1], POLLOUT, 0};
    return poll(&end, 1, 0) == 0;
  };
  EXPECT_TRUE(WaitUntil(full));
  int status = 0;
  const auto ended = [&] {
    kill(echo, SIGINT);
    return waitpid(echo, &status, WNOHANG) == echo;
  };
  EXPECT_TRUE(WaitUntil(ended));
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  for (const int end : ends) close(end);
}

TEST(WatchEndedRunTest, AReaderThatGoesAwayEndsEchoQuietly) {
  const RunFolder folder;
  const std::string run = folder / "run";
  ASSERT_EQ(RunPoise({"run", StandScenario(), "--inline", "--quiet", "--out", run}).exit_code, 0);
  const std::string errors = folder / "errors";
  // Far more than a pipe holds.
  const std::string command = "set -o pipefail; '" POISE_BIN_DIR
                              "/poise' echo GROUND_TRUTH --log '" +
                              run + "' 2>'" + errors + "' | head -n 3 >/dev/null";
  EXPECT_EQ(std::system(("bash -c \"" + command + "\"").c_str()), 0);
  EXPECT_EQ(std::ifstream(errors).peek(), std::ifstream::traits_type::eof());
}

}  // namespace
}  // namespace poise
