// The program `poise` from the outside, for whole-graph tests.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace poise {

inline constexpr std::chrono::seconds kLong{120};  // a test that waits so long has failed

/// What a program said and how it ended.
struct ProgramResult {
  int exit_code = -1;  ///< -1: ended by a signal, or had to be ended
  std::string output;  ///< stdout and stderr
};

/// `poise ARGUMENTS` as a child process.
class PoiseProgram {
 public:
  explicit PoiseProgram(const std::vector<std::string>& arguments);
  ~PoiseProgram();
  PoiseProgram(const PoiseProgram&) = delete;
  PoiseProgram& operator=(const PoiseProgram&) = delete;

  pid_t pid() const { return pid_; }
  /// Waits for its end; ends it after kLong.
  ProgramResult Wait();

 private:
  pid_t pid_ = -1;
  std::string output_file_;
};

/// Runs `poise ARGUMENTS` to its end.
ProgramResult RunPoise(const std::vector<std::string>& arguments);

/// Expects that `poise ARGUMENTS` ends with exit code 2 and one line that begins with "poise: " and
/// holds every one of `parts`.
void ExpectUsageError(const std::vector<std::string>& arguments,
                      const std::vector<std::string>& parts);

/// A folder that goes with the test, for runs.
class RunFolder {
 public:
  RunFolder();
  ~RunFolder();
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A deploy folder of its own for the programs that this process starts while it lives: the robots
/// and graphs of the house, its own scenarios, of which base/stand is StandScenario(), and its own
/// runs.
class TestDeploy {
 public:
  TestDeploy();
  ~TestDeploy();
  /// Writes scenarios/`name`.pbtxt and returns the file.
  std::string Scenario(const std::string& name, const std::string& text) const;
  std::string runs() const { return folder_ / "runs"; }
  std::string operator/(const std::string& name) const { return folder_ / name; }

 private:
  RunFolder folder_;
};

/// The scenarios of the house that have a section of the paper.
std::vector<std::string> Experiments();

/// The scenario "stand" of these tests.
std::string StandScenario();

nlohmann::json ReadSummary(const std::string& run);

/// A row of a CSV file, by column.
using CsvRow = std::map<std::string, std::string>;
/// RFC 4180; expects that all rows have the heading's columns.
std::vector<CsvRow> ReadCsv(const std::string& file);
/// The lines of `text`, without their ends.
std::vector<std::string> Lines(const std::string& text);
/// A whole file's bytes; empty when there is none.
std::string ReadAll(const std::filesystem::path& path);

/// Processes whose command line holds `text` (a run's folder), this one aside: by pid.
std::vector<pid_t> ProcessesWith(const std::string& text);
/// The process of component `component` of the run in `run`; -1 when there is none.
pid_t ComponentProcess(const std::string& run, const std::string& component);

/// Polls until `condition` holds, at most kLong; returns whether it did.
template <class Condition>
bool WaitUntil(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + kLong;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

inline constexpr uintmax_t kUnderWay = 200'000;  // bytes of log: some tens of ticks

/// True once the run's log has grown to `size` bytes: it is under way.
bool WaitForLog(const std::string& run, uintmax_t size);

}  // namespace poise
