#include "components/step_planner/footstep_report.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "components/framework/tick_time.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/stepping/footwork.h"

namespace poise {
namespace {

using robot::Foot;
using robot::Other;
using stepping::QuasiStaticWalk;
using Report = ::steps::footsteps_t;

constexpr int kCorners = stepping::kRegionDirections;
constexpr double kRegionPeriod = 0.02;  // s: what looks on draws no faster
constexpr double kLeastHeight = 0.1;    // m, of the COM above the sole: below, it has fallen

static_assert(sizeof(Report::x) / sizeof(double) == stepping::ContactPlan::kMost);
static_assert(sizeof(Report::region_x) / sizeof(double) ==
              (stepping::kMostRegionSteps + 1) * kCorners);

/// The foot that carries, or is to while the other steps; none: both do.
std::optional<Foot> Stance(const FootstepInput& input, const stepping::Recovery* recovery,
                           const QuasiStaticWalk* walk) {
  if (walk != nullptr && walk->active()) {
    if (walk->stage() == stepping::Stage::kCatching) return {};
    return Other(walk->stepping_foot());
  }
  if (recovery != nullptr && !recovery->steps().empty()) {
    return Other(recovery->steps().first().foot);
  }
  const bool right = input.in_contact[Foot::kRight];
  if (right == input.in_contact[Foot::kLeft]) return {};
  return right ? Foot::kRight : Foot::kLeft;
}

void Put(int i, const stepping::Footstep& step, double ground, double time_left, Report* out) {
  out->foot[i] = static_cast<int8_t>(step.foot);
  out->x[i] = step.at.position.x();
  out->y[i] = step.at.position.y();
  out->z[i] = ground;
  out->yaw[i] = step.at.yaw;
  out->touch_down[i] = std::max(0.0, time_left);
}

void ReportPlanned(const FootstepInput& input, const stepping::Recovery* recovery,
                   const QuasiStaticWalk* walk, Report* out) {
  const stepping::ContactPlan* const plan = walk != nullptr && walk->active() ? &walk->steps()
                                            : recovery != nullptr             ? &recovery->steps()
                                                                              : nullptr;
  int count = 0;
  if (plan != nullptr && !plan->empty()) {
    const double ground = input.sole[Other(plan->first().foot)].translation().z();
    for (const stepping::Footstep& step : *plan) {
      Put(count++, step, ground, step.touch_down - input.time, out);
    }
  }
  out->planned = static_cast<int8_t>(count);
  for (int i = count; i < static_cast<int>(stepping::ContactPlan::kMost); ++i) {
    Put(i, {}, 0, 0, out);
  }
}

}  // namespace

FootstepReport::FootstepReport(const stepping::Recovery* recovery, const QuasiStaticWalk* walk) {
  if (recovery != nullptr) recovery_regions_ = stepping::RegionFinder(recovery->choice());
  if (walk != nullptr) walk_regions_ = stepping::RegionFinder(walk->choice());
}

void FootstepReport::Update(const FootstepInput& input, const stepping::Recovery* recovery,
                            const QuasiStaticWalk* walk, Report* out) {
  ReportPlanned(input, recovery, walk, out);
  const std::optional<Foot> stance = Stance(input, recovery, walk);
  if (stance == stance_ && input.time < since_ + kRegionPeriod - kTimeTolerance) return;
  since_ = input.time;
  stance_ = stance;
  out->stance = stance ? static_cast<int8_t>(*stance) : int8_t{-1};
  std::fill(std::begin(out->corners), std::end(out->corners), int8_t{0});
  std::fill(std::begin(out->region_x), std::end(out->region_x), 0.0);
  std::fill(std::begin(out->region_y), std::end(out->region_y), 0.0);
  out->frequency = out->step_time[0] = out->step_time[1] = out->height = 0;
  if (!stance) return;
  const bool walks = walk != nullptr && (walk->active() || recovery == nullptr);
  const Eigen::Isometry3d& sole = input.sole[*stance];
  const double height = std::max(input.com_height - sole.translation().z(), kLeastHeight);
  stepping::RegionInput seen{.stance = *stance,
                             .sole = sole.translation().head<2>(),
                             .yaw = stepping::Yaw(sole),
                             .frequency = std::sqrt(robot::kGravity / height),
                             .step_time = walks ? walk->period() : 0};
  if (out->planned > 0) {
    seen.under_way = true;
    seen.foothold = {out->x[0], out->y[0]};
    seen.time_left = out->touch_down[0];
    // A walk is counted on where it is planned.
    if (!walks && recovery->stage() == stepping::Stage::kSwinging) {
      const double metre = stepping::LeastSwingTime(1, recovery->choice().limits().acceleration);
      seen.movable = seen.time_left * seen.time_left / (metre * metre);
    }
  }
  const stepping::CaptureRegions regions = (walks ? walk_regions_ : recovery_regions_).About(seen);
  out->frequency = seen.frequency;
  out->step_time[0] = regions.first;
  out->step_time[1] = regions.longest;
  out->height = sole.translation().z();
  for (size_t n = 0; n < regions.region.size(); ++n) {
    const balance::ConvexPolygon& region = regions.region[n];
    const int corners = std::min(region.num_corners, kCorners);
    out->corners[n] = static_cast<int8_t>(corners);
    for (int k = 0; k < corners; ++k) {
      const auto at = n * kCorners + static_cast<size_t>(k);
      out->region_x[at] = region.corner[static_cast<size_t>(k)].x();
      out->region_y[at] = region.corner[static_cast<size_t>(k)].y();
    }
  }
}

}  // namespace poise
