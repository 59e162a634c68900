// What led to a fall.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "logging/events/events.h"
#include "logging/run_record.h"

namespace poise {

/// Something wrong before a fall.
struct Trouble {
  std::string name;           ///< of its event
  std::string detail;         ///< of its event
  double begin = 0;           ///< s
  std::optional<double> end;  ///< s; empty: it had not ended as the robot fell
};

/// True for an event (logging::Events) that tells of something wrong before a run's end.
bool IsTrouble(std::string_view event);

/// What set in before `fall` (s) and did not end again; what else went wrong since the first of
/// that, and up to a second before, in the last seconds. In order; the first of each kind. What was
/// over long before is not among it: it happens where a robot stands, too.
std::vector<Trouble> TroublesBefore(double fall, const std::vector<logging::Event>& events);

/// "Before it fell: at 43.240 s, while the right foot was on its way, ...".
std::string TellFall(const logging::RunRecord& run, double fall,
                     const std::vector<logging::Event>& events);

/// The last time before the fall from which on everything is told in a list of events, s.
double DecisiveSince(double fall, const std::vector<logging::Event>& events);

}  // namespace poise
