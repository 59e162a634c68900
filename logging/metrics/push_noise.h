// Which readings of the sensor between pusher and robot are a push.
#pragma once

#include "logging/run_record.h"

namespace poise::logging {

/// N, below which a reading is noise: six of the sensor's deviations, which the record itself tells
/// by the median difference between neighbouring samples, which a push does not touch. Infinite of
/// a run with too few samples to tell.
double PushThreshold(const RunRecord& run);

}  // namespace poise::logging
