// The folder that a run leaves.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "components/framework/file_descriptor.h"
#include "components/framework/graph.pb.h"
#include "poise/run_info_t.hpp"

namespace poise {

/// Where runs without --out go: $POISE_RUNS_DIR; else runs/ beside deploy/ for who stands in that
/// checkout, and runs/ in the current folder for who stands elsewhere. Where that cannot be
/// written: poise/runs in $XDG_STATE_HOME, or in ~/.local/state.
std::filesystem::path RunsDir();

/// A run's folder, locked against other runs for as long as this lives. Programs that the run
/// starts do not inherit the lock.
class RunDir {
 public:
  /// Throws ConfigError when another run goes on in `path`, a folder.
  explicit RunDir(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  FileDescriptor fd_;
};

/// Makes the run's folder: `out`, or, when empty, a new one under runs/ named after date and
/// `name`. An `out` that holds anything is refused; `force` removes an earlier run's files from it
/// and leaves the rest. Throws ConfigError.
RunDir MakeRunDir(const std::string& out, const std::string& name, bool force);

inline constexpr char kSpecFile[] = "run_spec.pbtxt";
inline constexpr char kScenarioFile[] = "scenario.pbtxt";

/// Writes what describes a run into its folder: the texts of its spec and of its scenario. Throws
/// ConfigError.
void WriteRunFiles(const std::filesystem::path& dir, const run_info_t& info);

/// Removes the files that runs write into `dir`, and the folder where nothing else is in it.
/// Returns the bytes that this frees. Throws ConfigError when its run cannot be told.
int64_t RemoveRun(const RunDir& dir);

/// In a run's folder, the folder of the run that it is compared with.
std::filesystem::path ReferenceDir(const std::filesystem::path& dir);

/// Lets runs/latest point to `dir`, a folder below runs/; does nothing for one elsewhere.
void PointLatestTo(const std::filesystem::path& dir);

/// The log that `run` means: a folder of a run, a log, or, when empty, the latest run under runs/.
/// A packed log is made again. Throws ConfigError, LogError.
std::filesystem::path FindLog(const std::string& run);

/// FindLog of a run that has ended: throws ConfigError where it still goes on, too.
std::filesystem::path FindEndedLog(const std::string& run);

/// Warns on stderr where a log's RUN_INFO is damaged and the run is told by its folder's files.
void WarnOfRunInfo(const std::filesystem::path& log);

/// The run spec in a run's folder, or beside a log; empty `run`: of the latest run. It is there
/// before the log is. Throws ConfigError.
RunSpec ReadRunSpec(const std::string& run);

/// Name of the robot's file, without ending; empty: the run has none.
std::string RobotNameOf(const RunSpec& spec);

}  // namespace poise
