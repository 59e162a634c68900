// What the page of a run in progress is made of.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "logging/run_record.h"
#include "tools/live/tick_ring.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// Channels and their signals, without values: docs/reference/report_format.md#a-run-in-progress.
nlohmann::ordered_json ChannelsJson(const TickRing& ring);

/// RUN_INFO of a log that is being written, with the robot that it holds. Throws LogError,
/// RobotError.
logging::RunRecord ReadRunStart(const std::string& log);

/// Ticks of `seconds`, 1 at least.
int64_t TicksOf(double seconds, double period);

}  // namespace poise
