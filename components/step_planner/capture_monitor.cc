#include "components/step_planner/capture_monitor.h"

#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"

namespace poise {
namespace {

// m from the soles' edge that a foot can be put down at the most, of the step that is announced.
constexpr double kStepReach = 0.4;
// A step is needed once the capture point has been 0.01 m beyond the soles for 0.1 s: of 145 pushes
// that stood none raised this alarm, as the turning body brings a capture point back that is out
// for a moment (docs/reference/balance.md).
constexpr double kNeededExcess = 0.01, kNeededDuration = 0.1;

}  // namespace

void MonitorCapture(double time, const Eigen::Isometry3d& frame_o,
                    const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                    HeldCondition* step_needed, planner_status_t* status) {
  planner_status_t& out = *status;
  const auto world = [&](const Eigen::Vector2d& point) -> Eigen::Vector3d {
    return frame_o * Eigen::Vector3d(point.x(), point.y(), 0);
  };
  SetVector3(world(pendulum.position), out.capture_point);
  out.capture_margin = balance::SignedDistance(soles, pendulum.position);
  const bool outside = out.capture_margin < -kNeededExcess;
  out.step_needed = step_needed->Update(time, outside, kNeededDuration) ? 1 : 0;
  balance::Step step;
  if (out.step_needed != 0 && out.capture_margin < 0) {
    step = balance::LatestStep(soles, pendulum, kStepReach);
    SetVector3(world(step.position), out.step_position);
  } else if (out.step_needed == 0) {
    SetVector3(Eigen::Vector3d::Zero(), out.step_position);
  }
  out.step_time = step.time;
}

}  // namespace poise
