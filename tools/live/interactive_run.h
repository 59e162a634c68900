// A run inside this process at wall speed, with a page in control of it.
#pragma once

#include <string>

#include "components/framework/graph.pb.h"
#include "poise/run_info_t.hpp"
#include "tools/report/run_outcome.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

struct InteractiveOptions {
  int port = 0;      ///< of the page, on 127.0.0.1; 0: a free one
  double keep = 60;  ///< s that the page can look back
};

/// Runs until a signal comes; a run that has ended waits, since its page may go back. The log is
/// that of a run that went on from the start as it was left: to go back begins `log` anew with all
/// acts before that tick, and keeps the one that was left as branch_1.lcm, branch_2.lcm, ... beside
/// it. `spec` with the channels' counts. Throws ConfigError, LogError, RobotError.
RunOutcome RunInteractive(const RunSpec& spec, const Scenario& scenario, const run_info_t& info,
                          const std::string& log, const InteractiveOptions& options);

}  // namespace poise
