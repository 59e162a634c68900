// How a run ended.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace poise {

struct RunOutcome {
  bool completed = false;    ///< the planned end was reached, or a component ended the run well
  bool interrupted = false;  ///< by a signal
  std::string message;       ///< why the run ended; empty after the planned end
  std::vector<std::string> details;  ///< last lines of the output of the process at fault
  int64_t refused = 0;               ///< packets that the launcher refused on the service port
  double wall_time = 0;              ///< s, from the start command to the last tick
};

}  // namespace poise
