// What happened in a run, in two sentences.
#pragma once

#include <string>
#include <vector>

#include "logging/events/events.h"
#include "logging/run_record.h"
#include "tools/report/report.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// Why the run ended other than planned, as its components say; empty when none does.
std::string EndReason(const logging::RunRecord& run);

/// What happened to the robot, and by which steps; then what led to its fall, or else its figures,
/// beside the paper's where the scenario gives them. Everything comes from the run itself. `end`:
/// why the run ended, where its starter knows more than the log; empty otherwise.
std::string TellRun(const logging::RunRecord& run, const std::vector<CheckResult>& checks,
                    const std::vector<logging::Event>& events, const std::string& end);

}  // namespace poise
