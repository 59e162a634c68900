// What a log, or the run's folder around it, says of its run.
#pragma once

#include <string>

#include "components/framework/graph.pb.h"
#include "logging/log_reader.h"
#include "poise/run_info_t.hpp"

namespace poise::logging {

/// RUN_INFO and the spec it holds, the log's first event. Throws LogError.
run_info_t ReadRunInfo(LogReader* reader, const std::string& path, RunSpec* spec);

struct RunInfo {
  run_info_t info;
  RunSpec spec;
  /// Not empty: RUN_INFO is missing or damaged, and what the run's folder holds was taken: spec,
  /// robot and URDF of run_spec.pbtxt, the scenario of scenario.pbtxt (empty without that file),
  /// no started_at.
  std::string warning;
};

/// The run of a log, checked (CheckLogSpec): RUN_INFO, or when that cannot be used the files beside
/// the log, if its messages are of that run. `reader` stands after RUN_INFO, or at the log's
/// beginning. Throws LogError saying what is missing and what to do.
RunInfo FindRunInfo(LogReader* reader, const std::string& path);

/// FindRunInfo's warning; empty also for a log of which nothing can be told.
std::string RunInfoWarning(const std::string& path);

}  // namespace poise::logging
