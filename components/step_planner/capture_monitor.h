// Whether the capture point has left what the soles can stop, and the step that it then asks for.
#pragma once

#include <Eigen/Geometry>

#include "components/balance/capture_point.h"
#include "components/balance/convex_polygon.h"
#include "components/framework/tick_time.h"
#include "poise/planner_status_t.hpp"

namespace poise {

/// Capture point and the step that it asks for; `soles` in `frame_o`, at least a corner.
void MonitorCapture(double time, const Eigen::Isometry3d& frame_o,
                    const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                    HeldCondition* step_needed, planner_status_t* status);

}  // namespace poise
