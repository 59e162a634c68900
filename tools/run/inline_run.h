// Runs a graph inside this process.
#pragma once

#include <optional>
#include <string>

#include "components/framework/graph.h"
#include "logging/run_record.h"
#include "poise/run_info_t.hpp"
#include "tools/cli/progress.h"
#include "tools/report/run_outcome.h"

namespace poise {

/// Runs the components of `graph` to the end or until a stop signal, with the log in `log_path`; a
/// run in real time is paced with the wall clock. `record`, where given, gets what ReadRun reads of
/// the log, unless the run is so long that it is better read back. Throws ConfigError or LogError.
RunOutcome RunInline(const RunSpec& spec, BoundGraph graph, const run_info_t& info,
                     const std::string& log_path, Progress* progress,
                     std::optional<logging::RunRecord>* record = nullptr);

/// Starts this program anew with the same arguments and a library that counts allocations, of which
/// RunInline then tells. Returns where it is there already. Throws ConfigError: there is none.
void CountAllocations();

}  // namespace poise
