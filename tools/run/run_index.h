// The runs that have left a folder below RunsDir(), as their own files tell of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace poise {

struct PastRun {
  std::filesystem::path dir;
  bool own = false;        ///< this user's
  std::string started_at;  ///< ISO 8601 UTC
  std::string robot;       ///< its file's name, without ending
  std::string scenario;
  /// "passed: stands", "FAILED: fell at 1.234 s", "goes on"; "not judged" without a summary.json.
  std::string outcome;
  std::vector<std::string> flags;  ///< of `poise run`, that made it another run of the scenario
  int64_t bytes = 0;               ///< of all that the folder holds
};

/// All past runs, those of matrices, sweeps and the like by themselves; the newest first.
std::vector<PastRun> PastRuns();

/// A table of them, folders as seen from RunsDir().
std::string FormatPastRuns(const std::vector<PastRun>& runs);

}  // namespace poise
