// Where poise writes: nothing is destroyed silently, and what cannot be written is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <regex>

#include "tests/graph/current_folder.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// No file that this process or its children write grows beyond `bytes` while it lives: a disk that
/// is full, for a user without privileges.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

class OutputPlaceTest : public testing::Test {
 protected:
  std::vector<std::string> Run(const std::vector<std::string>& flags) const {
    std::vector<std::string> arguments = {"run", StandScenario(), "--quiet", "--out", run_};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return arguments;
  }

  RunFolder folder_;
  std::string run_ = folder_ / "run";
};

TEST_F(OutputPlaceTest, NothingIsReplacedWithoutForce) {
  ASSERT_EQ(RunPoise(Run({"--inline"})).exit_code, 0);
  const std::string log = ReadAll(run_ + "/run.lcm");
  ExpectUsageError(Run({"--inline"}), {"--out", run_, "holds a run", "--force"});
  ExpectUsageError({"run", StandScenario(), StandScenario(), "--inline", "--out", run_},
                   {"--force"});
  ExpectUsageError({"matrix", StandScenario(), "--out", run_}, {"holds a run", "--force"});
  ExpectUsageError({"sweep", StandScenario(), "--vary", "seed=1,2", "--out", run_}, {"--force"});
  ExpectUsageError({"log", "export", run_, "--csv", run_}, {"--csv", "--force"});
  EXPECT_EQ(ReadAll(run_ + "/run.lcm"), log);

  const std::string mine = folder_ / "mine.txt";
  std::ofstream(mine) << "my notes";
  ExpectUsageError({"report", run_, "--html", mine}, {"--html", mine, "--force"});
  ExpectUsageError({"log", "export", run_, "--merged", mine}, {"--merged", mine, "--force"});
  ExpectUsageError({"log", "export", run_, "--mcap", mine}, {"--mcap", mine, "--force"});
  ExpectUsageError({"log", "cut", run_, "--to", "0.1", "--out", mine}, {"--out", mine, "--force"});
  ExpectUsageError({"run", StandScenario(), "--drives", "ethercat", "--capture", mine},
                   {"--capture", mine, "--force"});
  ExpectUsageError({"run", StandScenario(), "--drives", "ethercat", "--capture", mine + "/a.pcap"},
                   {"--capture", "cannot be written: Not a directory"});
  EXPECT_EQ(ReadAll(mine), "my notes");

  EXPECT_EQ(RunPoise(Run({"--inline", "--force", "--duration", "0.2"})).exit_code, 0);
  EXPECT_LT(fs::file_size(run_ + "/run.lcm"), log.size());
  EXPECT_EQ(RunPoise({"log", "cut", run_, "--to", "0.1", "--out", mine, "--force"}).exit_code, 0);
  EXPECT_NE(ReadAll(mine), "my notes");
  ExpectUsageError({"log", "cut", run_, "--out", run_ + "/run.lcm", "--force"}, {"the log itself"});
}

TEST_F(OutputPlaceTest, AFullDiskIsNamed) {
  for (const bool in_process : {true, false}) {
    const FileSizeLimit limit(300'000);
    std::vector<std::string> flags = {"--duration", "2", "--force"};
    if (in_process) flags.emplace_back("--inline");
    const ProgramResult result = RunPoise(Run(flags));
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_THAT(result.output, AllOf(HasSubstr("run.lcm: writing failed: File too large"),
                                     Not(HasSubstr("signal"))));
    EXPECT_TRUE(ProcessesWith(run_).empty());
  }
  ASSERT_EQ(RunPoise(Run({"--inline", "--force"})).exit_code, 0);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"report", run_, "--html", "/dev/full"},
        {"log", "export", run_, "--merged", "/dev/full"},
        {"log", "export", run_, "--mcap", "/dev/full"}}) {
    const ProgramResult result = RunPoise(command);
    EXPECT_NE(result.exit_code, 0) << result.output;
    EXPECT_THAT(result.output, HasSubstr("No space left on device")) << command[0];
  }
  const std::string text = folder_ / "text";
  const int status =
      std::system((std::string(POISE_BIN_DIR "/poise list metrics >/dev/full 2>") + text).c_str());
  EXPECT_NE(status, 0);
  EXPECT_THAT(ReadAll(text), HasSubstr("No space left on device"));
}

TEST_F(OutputPlaceTest, WhatAFullDiskLeavesOfAFileDoesNotBlockTheNextTry) {
  const CurrentFolder here(folder_ / "");
  {
    const FileSizeLimit limit(1000);
    ExpectUsageError({"new", "scenario", "mine"}, {"mine.pbtxt", "File too large"});
  }
  EXPECT_EQ(RunPoise({"new", "scenario", "mine"}).exit_code, 0);
}

TEST_F(OutputPlaceTest, ARunNeedsNoStandardStream) {
  const std::string command = POISE_BIN_DIR "/poise run " + StandScenario() +
                              " --quiet --duration 0.1 --out " + run_ + " <&- >&- 2>&-";
  EXPECT_NE(std::system(command.c_str()), 2 << 8);
  EXPECT_EQ(ReadSummary(run_)["passed"], true);
}

TEST_F(OutputPlaceTest, ALogThatCannotFitIsRefusedAndItsSizeIsRight) {
  std::string output;
  {
    const FileSizeLimit limit(100'000);
    const ProgramResult refused = RunPoise(Run({"--inline", "--duration", "2"}));
    EXPECT_EQ(refused.exit_code, 2) << refused.output;
    EXPECT_THAT(refused.output, AllOf(HasSubstr("ulimit -f"), HasSubstr("--force")));
    EXPECT_FALSE(fs::exists(run_));
    output = refused.output;
  }
  std::smatch found;
  ASSERT_TRUE(std::regex_search(output, found, std::regex("will take about ([0-9.]+) (kB|MB)")));
  const double expected = (found[2] == "kB" ? 1e3 : 1e6) * std::stod(found[1]);
  // As processes: their health comes on top.
  ASSERT_EQ(RunPoise(Run({"--duration", "2"})).exit_code, 0);
  const auto size = static_cast<double>(fs::file_size(run_ + "/run.lcm"));
  EXPECT_NEAR(expected / size, 1, 0.1);
}

TEST_F(OutputPlaceTest, APartOfARunIsNotJudgedAsAWhole) {
  ASSERT_EQ(RunPoise(Run({"--inline"})).exit_code, 0);
  const std::string part = folder_ / "part.lcm";
  ASSERT_EQ(RunPoise({"log", "cut", run_, "--from", "0.1", "--to", "0.2", "--out", part}).exit_code,
            0);
  const ProgramResult report = RunPoise({"report", part, "--no-html", "--full"});
  EXPECT_EQ(report.exit_code, 0) << report.output;
  EXPECT_THAT(report.output, AllOf(HasSubstr("part of a run"), Not(HasSubstr("FAILED"))));
}

TEST_F(OutputPlaceTest, AFileThatIsNoLogIsNotDescribedAsOne) {
  const std::string text = folder_ / "text";
  std::ofstream(text) << "no log at all\n";
  ExpectUsageError({"log", "info", text}, {text, "no event log"});
}

TEST_F(OutputPlaceTest, FieldsAreNamedByWhatTheyLimit) {
  const std::string check = "check[violated_ticks]";
  ExpectUsageError({"run", StandScenario(), "--set", check + ".at_least=5"},
                   {"--set " + check + ".at_least: is 5, above the check's at_most, 0",
                    "--set 'check[violated_ticks].at_most='"});
  ExpectUsageError({"run", StandScenario(), "--set", "check[violated].at_most=5"},
                   {"no check is called 'violated'", "violated_ticks"});
  ExpectUsageError({"run", StandScenario(), "--set", "sim.push[0].peak=100N"},
                   {"'100N' is not a number; its unit is N", "sim.push[0].peak=100"});
  ExpectUsageError({"run", StandScenario(), "--set", "sim.push.peak=100"},
                   {"write sim.push[0].peak"});
  EXPECT_EQ(RunPoise(Run({"--inline", "--set", check + ".at_most=7"})).exit_code, 0);
  const nlohmann::json checks = ReadSummary(run_)["checks"];
  for (const nlohmann::json& row : checks) {
    if (row["name"] != "violated_ticks") continue;
    EXPECT_EQ(row["at_most"], 7);
  }
}

}  // namespace
}  // namespace poise
