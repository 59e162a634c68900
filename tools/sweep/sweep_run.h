// One run of a sweep.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/scenario/push_bound.h"
#include "tools/scenario/scenario_loading.h"
#include "tools/sweep/sweep_workers.h"

namespace poise {

/// How a run of a sweep ended, by name in tables.
inline constexpr char kStands[] = "stands";
inline constexpr char kFell[] = "fell";
inline constexpr char kMissed[] = "missed";    ///< stood, but did not do what the sweep asks for
inline constexpr char kStopped[] = "stopped";  ///< ended early, but not by a fall
inline constexpr char kInvalid[] = "invalid";  ///< its configuration cannot be run
inline constexpr char kCrashed[] = "crashed";  ///< the program did or was killed, or a stage threw
inline constexpr char kHung[] = "hung";        ///< no tick came any more

/// A finished run: a row of the table without its variables.
struct SweepRow {
  int64_t run = 0;
  std::optional<double> limit;  ///< value of the quantity whose limit is sought
  std::string outcome;
  std::optional<double> fell_at;  ///< s
  double ended_at = 0;            ///< s, simulated
  std::string phase;              ///< the schedule's at the end
  /// Names of what went wrong until the end (logging::Events), in order, each once, joined by +.
  std::string trouble;
  std::string reason;  ///< why it ended early, or what it missed
  /// Whose stage a run was in when it was stopped, crashed or hung; empty: none's, or not known.
  std::string component, stage;
  std::map<std::string, double> metrics;  ///< empty where survived() is
  std::optional<PushBound> push;

  bool stands() const { return outcome == kStands; }
  bool fell() const { return outcome == kFell; }
  bool missed() const { return outcome == kMissed; }
  /// Whether the robot stood, and did what it was to do; empty: the run does not tell, and counts
  /// for nothing.
  std::optional<bool> survived() const {
    return stands() || fell() || missed() ? std::optional(stands()) : std::nullopt;
  }
  /// "hung in policy, stage walk, at 1.234 s: its stage ...".
  std::string Ending() const;
  bool operator==(const SweepRow& other) const { return RowText(*this) == RowText(other); }

  /// The row as a line of JSON, without its end.
  static std::string RowText(const SweepRow& row);
  /// Throws std::exception for what is none.
  static SweepRow Parse(const std::string& text);
};

/// Runs `scenario` with `changes` in this process, without a log, or with a run's folder in
/// `log_dir`; as processes, in lockstep, where drives are emulated or a component is a program of
/// its own (described_components.h): the row is the same. What cannot be run is kInvalid. `row`:
/// its run and limit are taken from it; `status` shows where it is. `required`: Sweep.require.
/// Throws what only the machine can be blamed for: memory, disk.
SweepRow RunPoint(const std::string& scenario, const RunChanges& changes,
                  const std::vector<std::string>& metrics, const std::vector<std::string>& required,
                  const std::string& log_dir, SweepRow row, TaskStatus* status);

}  // namespace poise
