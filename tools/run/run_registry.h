// Which runs go on, wherever their folders are.
//
// Each run keeps a small file that it holds a lock on, in every folder of RegistryDirs() that it
// can write: the file holds the run's folder, the lock tells whether the run lives. The run's own
// folder need not be readable for that, or be mounted where the reader is.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/file_descriptor.h"

namespace poise {

/// Keeps a run registered for as long as this lives. A registry that cannot be written fails no
/// run: it then cannot be found without its folder, of which stderr is told.
class RunRegistration {
 public:
  explicit RunRegistration(const std::filesystem::path& run_dir);
  /// The run has become the latest that ended.
  ~RunRegistration();
  RunRegistration(const RunRegistration&) = delete;
  RunRegistration& operator=(const RunRegistration&) = delete;

 private:
  struct Entry {
    std::filesystem::path file;
    FileDescriptor fd;
  };
  std::vector<Entry> entries_;
};

/// A run that goes on, of this user or another.
struct RunningRun {
  std::filesystem::path dir;
  std::string user;        ///< whose it is
  bool own = true;         ///< this user's; others' are acted on only when they are named
  bool readable = true;    ///< false: run_spec.pbtxt cannot be read from here
  bool networked = false;  ///< heard and stopped from outside; false: inside one process
  std::string scenario;
  std::string robot;  ///< its file's name, without ending
  int64_t run_id = 0;
  std::time_t start = 0;  ///< in whole seconds, as every command says it
  double age = 0;         ///< s since its start
};

/// Every run that is registered and lives, the newest first; entries of runs that died are removed.
/// A run that could not register is among them when runs/latest points to it.
std::vector<RunningRun> RunningRuns();

/// Folder of the run of this user that ended last and is still there; empty: none is known.
std::filesystem::path LatestEndedRun();

/// "FOLDER  (stand, robot dyros_legs, since 11:24:03, for 12 s)"
std::string FormatRun(const RunningRun& run);
/// A line a run.
std::string FormatRuns(const std::vector<RunningRun>& runs);

/// The one run that goes on, for a command that was given none. Throws ConfigError: none (with the
/// latest that ended, to be looked at with `log_command`), or several, which it lists with how to
/// name one: `command` is what stands before the name, as "poise push --run".
RunningRun OnlyRunningRun(std::string_view log_command, std::string_view command);

/// Folders that `name` means: the folder itself if a run goes on there; else every run that goes on
/// whose folder's last part, scenario or number it is, this user's before others'; else the folder
/// or file, if there is one. Throws ConfigError when there is none.
std::vector<std::filesystem::path> RunsNamed(const std::string& name);
/// RunsNamed for a command that takes one run; throws ConfigError also when `name` means several.
std::filesystem::path RunNamed(const std::string& name, std::string_view command);

/// $POISE_RUNTIME_DIR alone, or below both $XDG_RUNTIME_DIR, which ends with the user's last login,
/// and /tmp, which other programs may clean up.
std::vector<std::filesystem::path> RegistryDirs();

}  // namespace poise
