// The runs of a sweep or of a limit's search, kept in a folder.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/run/run_dir.h"
#include "tools/sweep/sweep_definition.h"
#include "tools/sweep/sweep_results.h"
#include "tools/sweep/sweep_workers.h"

namespace poise {

inline constexpr char kKindSweep[] = "sweep";
inline constexpr char kKindLimit[] = "limit";

/// How the runs are made; the results do not depend on it.
struct SessionOptions {
  std::string out;    ///< empty: a dated folder under runs/
  std::string range;  ///< "A:B": runs A to B - 1
  std::string part;   ///< "K/N": the K-th of N shares, K from 1
  int jobs = 1;       ///< at a time
  bool resume = false;
  bool force = false;  ///< replace what `out` holds
  bool logs = false;
  bool quiet = false;
};

/// What a sweep's command line says. What an Add function is given must outlive the parsing.
struct SweepOptions {
  SweepArguments arguments;
  SessionOptions session;
};

/// Adds what `poise sweep`, `limit` and `ladder` share.
void AddSweepOptions(CLI::App* app, SweepOptions* options);

/// Adds --variant, --without, --ideal, --set and --duration. `set`: the meaning of --set.
void AddChangeOptions(CLI::App* app, RunChanges* changes, const std::string& set);
/// Adds --world; `default_of`: whose engine is taken without it.
void AddWorld(CLI::App* app, std::string* world, const std::string& default_of);
CLI::Option* AddDrives(CLI::App* app, std::string* drives);
/// Adds --jobs, of which there are as many as processors; `text`: the meaning.
void AddJobs(CLI::App* app, int* jobs, const std::string& text);

/// First run and the one after the last. Throws ConfigError for a range or part that is none.
std::pair<int64_t, int64_t> SelectedRuns(const SessionOptions& options, int64_t size);

class SweepSession {
 public:
  struct Request {
    int64_t run = 0;
    std::optional<double> limit;
    bool again = false;  ///< it is made once more
  };
  struct Progress {
    double done = 0, total = 1;  ///< runs
    std::string text;
  };

  /// Locks and reads the folder. Throws ConfigError: it holds results and is not to be resumed, or
  /// those of another sweep or of another build of poise.
  SweepSession(const SweepDefinition& definition, const std::string& kind,
               const SessionOptions& options);

  /// Runs what `next` gives until it gives nothing and nothing runs; `done` gets each row when it
  /// is on the disk. A run that was stopped, crashed or hung is made once more. False when a signal
  /// ended it. Throws std::runtime_error when a run could not be made for want of memory or disk,
  /// ConfigError where the disk cannot hold the logs.
  bool Run(const std::function<std::optional<Request>()>& next,
           const std::function<void(const SweepRow&)>& done,
           const std::function<Progress()>& progress);

  const std::filesystem::path& folder() const { return dir_.path(); }
  const SweepHeader& header() const { return header_; }
  const SweepRows& rows() const { return rows_; }
  /// Rows that were there before.
  size_t found() const { return found_; }

 private:
  /// What to say of the room that `runs` logs take, from the first point's; empty: little. Throws
  /// ConfigError where the disk cannot hold them, unless --force.
  std::string RoomForLogs(double runs) const;
  /// Makes the row of a process that has ended: its answer, or that it crashed or hung.
  static SweepRow RowOf(const Request& request, const ForkedTasks::Result& result);

  const SweepDefinition& definition_;
  SessionOptions options_;
  SweepHeader header_;
  RunDir dir_;
  SweepRows rows_;
  size_t found_ = 0;
  std::optional<SweepResults> on_disk_;
  std::optional<SweepResultsWriter> writer_;  // from the first Run on
};

/// Points `first` to `end` - 1.
std::vector<int64_t> PointRange(int64_t first, int64_t end);

/// Runs the points of a sweep that have no row yet, with progress. False when a signal ended it.
/// Throws as SweepSession::Run does.
bool RunPoints(const std::vector<int64_t>& points, SweepSession* session);

/// Searches the limit at these points, from what is known, with progress. `session`: of a search
/// for limits. As RunPoints.
bool RunLimits(const std::vector<int64_t>& points, SweepSession* session);

/// How many of these points have a row.
int64_t CountDone(int64_t first, int64_t end, const SweepRows& rows);

/// Empty: `found` is of the same sweep and program as `header`; else what differs and what to do.
std::string HeaderProblem(const SweepHeader& header, const SweepHeader& found);

}  // namespace poise
