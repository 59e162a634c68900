#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "components/balance/convex_polygon.h"
#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/events/event_groups.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/planner_steps.h"

namespace poise::logging {
namespace {

// m of the capture point beyond what a walk's step covers: that the planner calls beyond the soles.
constexpr double kStrays = 0.01;

/// Why the centre of pressure is not within its limits.
std::string NotAchievedText(const balance_torque_t& balance) {
  // A wrench that does not press on the ground has none, and the message has zeros.
  const double pulls = balance.resultant_task.force[2];
  if (!(pulls < 0)) {
    return fmt::format("no CoP: the task torque would pull at the ground with {:.0f} N", pulls);
  }
  const Eigen::Vector2d cop(balance.cop[0], balance.cop[1]);
  const std::string at =
      fmt::format("CoP ({:.1f}, {:.1f}) mm", Tenths(kMilli * cop.x()), Tenths(kMilli * cop.y()));
  if (balance.region != balance_torque_t::REGION_POLYGON || balance.num_corners < 3) {
    return fmt::format("{}, limits ({:.1f}, {:.1f}) mm", at, kMilli * balance.cop_limit[0],
                       kMilli * balance.cop_limit[1]);
  }
  const double inside = balance::SignedDistance(AcceptableRegion(balance), cop);
  return inside < 0 ? fmt::format("{}, {:.1f} mm outside the soles' region", at, -kMilli * inside)
                    : fmt::format("{}, at the edge of the soles' region", at);
}

void AddBalancing(const RunRecord& run, EventList* events) {
  for (const auto& [axis, name] : {std::pair{0, "x"}, std::pair{1, "y"}}) {
    const auto on = OfTick(run.balance, [&, a = axis](const balance_torque_t& balance) {
      return (a == 0 ? balance.active_x : balance.active_y) != 0;
    });
    const std::vector<Interval> intervals = Intervals(run, on);
    for (const Interval& interval : intervals) {
      const balance_torque_t* balance = run.balance.at(interval.begin);
      events->Add(interval.begin, "balancing_on",
                  fmt::format("{}: CoP of the task torque {:.1f} mm, limit {:.1f} mm", name,
                              kMilli * balance->cop_task[axis], kMilli * balance->cop_limit[axis]));
      events->AddEndOf(interval, "balancing_off", name);
    }
  }
  const auto not_achieved = OfTick(run.balance, [](const balance_torque_t& balance) {
    return balance.status == balance_torque_t::STATUS_NOT_ACHIEVED;
  });
  events->AddIntervals(Intervals(run, not_achieved), "cop_not_achieved_begins",
                       "cop_not_achieved_ends",
                       [&](int64_t tick) { return NotAchievedText(*run.balance.at(tick)); });
  const auto infeasible = OfTick(run.command, RatioIsInfeasible);
  events->AddIntervals(Intervals(run, infeasible), "eta_infeasible_begins", "eta_infeasible_ends",
                       [&](int64_t tick) {
                         return fmt::format("no ratio meets all conditions; eta {:.3f}",
                                            run.command.at(tick)->eta);
                       });
}

/// The robot walks, and the capture point is within the sole that carries, the planned foothold and
/// what lies between: the step that is needed is the one under way.
bool WalksThere(const RunRecord& run, const planner_status_t& planner) {
  if (planner.stepping == planner_status_t::STEPPING_NONE || planner.step_foot < 0 ||
      planner.step_foot > 1 || planner.step_reason != planner_status_t::REASON_WALK) {
    return false;
  }
  const auto foot = static_cast<size_t>(planner.step_foot);
  const Eigen::Isometry3d stance = GetPose(planner.foot_pose[1 - foot]);
  // The foothold's heading is not told: it is nearly the stance foot's.
  Eigen::Isometry3d foothold = stance;
  foothold.translation() = GetVector3(planner.foothold);
  std::array<Eigen::Vector2d, balance::ConvexPolygon::kMaxCorners> points;
  size_t count = 0;
  for (const auto& [pose, sole] : {std::pair{stance, 1 - foot}, std::pair{foothold, foot}}) {
    const balance::ConvexPolygon polygon = balance::SolePolygon(run.robot.feet()[sole], 0);
    for (const Eigen::Vector2d& corner : polygon.corners()) {
      if (count == points.size()) break;
      points[count++] = (pose * Eigen::Vector3d(corner.x(), corner.y(), 0)).head<2>();
    }
  }
  const Eigen::Vector2d point(planner.capture_point[0], planner.capture_point[1]);
  return balance::SignedDistance(balance::ConvexHull({points.data(), count}), point) > -kStrays;
}

void AddCapturePoint(const RunRecord& run, EventList* events) {
  const auto needed = OfTick(run.planner, [&](const planner_status_t& planner) {
    return planner.step_needed != 0 && !WalksThere(run, planner);
  });
  const std::vector<Interval> intervals = Intervals(run, needed);
  for (const Interval& interval : intervals) {
    const planner_status_t& planner = *run.planner.at(interval.begin);
    events->Add(interval.begin, "step_needed",
                fmt::format("a foot at ({:.2f}, {:.2f}) m within {:.2f} s; capture point {:.1f} mm "
                            "beyond the soles",
                            planner.step_position[0], planner.step_position[1], planner.step_time,
                            -kMilli * planner.capture_margin));
    events->AddEndOf(interval, "step_needed_ends", "capture point inside the soles again");
  }
}

/// "107.8 mm inside the soles".
std::string Inside(double margin) {
  const double tenths = Tenths(kMilli * margin);
  return fmt::format("{:.1f} mm {} the soles", std::abs(tenths), tenths < 0 ? "outside" : "inside");
}

void AddSteps(const RunRecord& run, EventList* events) {
  for (const PlannerStep& step : PlannerSteps(run)) {
    const std::string foot = FootName(run, step.foot);
    // A walk's foot is unloaded before its touch-down is timed.
    const std::string in_time =
        step.planned_time > 0 ? fmt::format(" in {:.2f} s", step.planned_time) : std::string();
    events->Add(step.begin, "step_begins",
                fmt::format("{} to ({:.2f}, {:.2f}) m{}: {}", foot, step.planned.x(),
                            step.planned.y(), in_time, StepReason(step.reason)));
    if (!step.landing) continue;
    // A walk plans no capture point.
    const bool catches = step.reason != planner_status_t::REASON_WALK &&
                         step.reason != planner_status_t::REASON_TOGETHER;
    events->Add(
        *step.landing, "step_lands",
        fmt::format("{} at ({:.2f}, {:.2f}) m, {:.0f} mm from its last foothold, {:.0f} mm "
                    "from where it stood (planned at first {:.0f} mm); capture point {}{}",
                    foot, step.landed.x(), step.landed.y(),
                    kMilli * (step.landed - step.foothold).norm(),
                    kMilli * (step.landed - step.from).norm(),
                    kMilli * (step.planned - step.from).norm(), Inside(step.margin),
                    catches ? fmt::format(" (planned {})", Inside(step.planned_margin)) : ""));
  }
  int8_t before = planner_status_t::STEPPING_NONE;
  for (const auto& [tick, planner] : Messages(run.planner, 0, run.num_ticks)) {
    if (before != planner_status_t::STEPPING_NONE &&
        planner->stepping == planner_status_t::STEPPING_NONE) {
      events->Add(tick, "step_rests", "the COM is at rest between the feet");
    }
    before = planner->stepping;
  }
}

}  // namespace

void AddBalanceEvents(const RunRecord& run, EventList* events) {
  AddBalancing(run, events);
  AddCapturePoint(run, events);
  AddSteps(run, events);
}

}  // namespace poise::logging
