// From where the capture point can be brought to rest with a number of steps.
#pragma once

#include <Eigen/Core>
#include <array>

#include "components/balance/convex_polygon.h"
#include "components/step_planner/stepping/step_choice.h"

namespace poise::stepping {

inline constexpr int kMostRegionSteps = 2;
inline constexpr int kRegionDirections = 16;

/// The robot from above as regions see it; world axes.
struct RegionInput {
  Foot stance = Foot::kRight;                      ///< the foot that carries
  Eigen::Vector2d sole = Eigen::Vector2d::Zero();  ///< m, its sole's centre
  double yaw = 0;                                  ///< rad, of that sole
  double frequency = 1;                            ///< 1/s, of the pendulum
  double step_time = 0;                            ///< s a step; 0: what each swing takes
  /// The step under way, if any: where its foot comes down, m, in how many s, and by how many m
  /// that place can still be moved.
  bool under_way = false;
  Eigen::Vector2d foothold = Eigen::Vector2d::Zero();
  double time_left = 0, movable = 0;
};

struct CaptureRegions {
  /// By number of steps, m, world.
  std::array<balance::ConvexPolygon, kMostRegionSteps + 1> region;
  double first = 0, longest = 0;  ///< s, of the first step, and of any; 0: no foothold in reach
};

/// The regions of Koolen et al. 2012 (d_N = r + (l − r + d_{N−1}) e^{−ωT}) with polygons for r and
/// l: in each direction u, by the farthest points s of the stance sole less `sole_margin`, f of the
/// footholds in reach and d_{N−1} of the region of N − 1 steps about the other foot,
///
///     d_N = (1 − e^{−ωT}) s + e^{−ωT} (f + d_{N−1}),    d_0 = s
///
/// and d_{N−1} about this foot where that is farther. Each point so found can be brought to rest by
/// that foothold; between the directions a region is their hull. Approximated: the pendulum's
/// height stays, feet come down parallel, the COM is above the stance sole when a foot comes down,
/// and a swing begins beside it and takes its least time.
class RegionFinder {
 public:
  /// Finds nothing.
  RegionFinder() = default;
  /// Keeps s, f and swings' times, which a robot does not change.
  explicit RegionFinder(const StepChoice& choice);

  /// Pure, never allocates.
  CaptureRegions About(const RegionInput& input) const;

 private:
  using Points = std::array<Eigen::Vector2d, kRegionDirections>;

  bool stands_ = false, reaches_ = false;
  // By foot, in axes of the heading: its sole's from its centre; its footholds' with the other
  // sole's centre at the origin, and the s that its swing there takes.
  FootArray<Points> edge_, foothold_;
  FootArray<std::array<double, kRegionDirections>> time_{};
  FootArray<balance::ConvexPolygon> footholds_;
};

}  // namespace poise::stepping
