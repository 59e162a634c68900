// What a sweep or a search for limits came to, as tables.
#pragma once

#include <string>
#include <vector>

#include "tools/sweep/limit_search.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_results.h"

namespace poise {

/// A row a run, in their order: run, the variables, outcome, fell_at, ended_at, phase, trouble,
/// reason, component, stage, the metrics. The same rows give the same bytes.
std::string SweepCsv(const SweepHeader& header, const SweepRows& rows);

/// A point of the grid, for which a limit is sought.
struct LimitPoint {
  int64_t run = 0;
  LimitSearch search;
  const SweepRow* at_limit = nullptr;  ///< of the run at the limit; nullptr: there is none
  const SweepRow* at_fall = nullptr;   ///< of the run at fails_at
  const SweepRow* at_largest = nullptr;
  const SweepRow* any = nullptr;  ///< of some run
  int untold = 0;                 ///< runs that do not tell whether the robot stood
};
/// Returns the points that have rows. Pointers are into `rows`.
std::vector<LimitPoint> LimitPoints(const SweepHeader& header, const SweepRows& rows);

/// A row a point. After the variables: the limit under its name, fails_at, largest_survived,
/// monotone, runs, and how many of these do not tell; of a push, also its impulse and the
/// pendulum's bounds (push_bound.h) with the shares reached; the phase, trouble and reason of the
/// run at fails_at.
std::string LimitCsv(const SweepHeader& header, const SweepRows& rows);

/// How many of which outcome, and the fallen ones by phase and trouble. Where step_needed_time and
/// step_warning_time are among the columns also how many falls the capture point announced, how
/// many of the runs that stand it announced in vain, and the median of the warning times.
std::string FormatOutcomes(const SweepHeader& header, const SweepRows& rows);

/// The limits in aligned columns.
std::string FormatLimits(const SweepHeader& header, const SweepRows& rows);

/// "direction 90, force 120": the variables of a run, and at which value of the quantity whose
/// limit is sought.
std::string PlaceText(const SweepPoints& points, const SweepRow& row);

/// The runs that do not tell whether the robot stood, a line each with what is known of their end;
/// empty: there are none.
std::string FormatUntold(const SweepHeader& header, const SweepRows& rows);
/// The runs that missed what is asked of them, in the form of FormatUntold.
std::string FormatMissed(const SweepHeader& header, const SweepRows& rows);

}  // namespace poise
