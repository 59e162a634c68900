// What every listener to a run in progress begins with.
#pragma once

#include <chrono>
#include <string>

#include "logging/run_record.h"
#include "tools/run/live_run.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// A process that wakes up then takes no core from one of the run; where all cores are busy this
/// one waits. Warns where the system does not allow it.
void StandBack();

/// RUN_INFO of a log that is being written, with the robot that it holds. Throws LogError,
/// RobotError.
logging::RunRecord ReadRunStart(const std::string& log);

/// ReadRunStart, as soon as the recorder has written it: info, spec and robot. Throws LogError when
/// it does not within `patience`, ConfigError when it is of another run than `live`.
logging::RunRecord ReadStart(const LiveRun& live, std::chrono::milliseconds patience);

/// The scenario of a run whose start was read. Throws ConfigError.
Scenario ReadScenario(const LiveRun& live, const logging::RunRecord& record);

}  // namespace poise
