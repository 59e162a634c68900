// Where a foot that could not stand is put down instead, and what is known of the ground's height.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "components/balance/convex_polygon.h"
#include "components/step_planner/stepping/footsteps.h"

namespace poise::stepping {

/// Places that AnotherPlace knows for a step.
inline constexpr int kMostPlaces = 4;

/// The foothold of `foot` after `first` could not be stood on, for attempt 1 to kMostPlaces: ahead
/// of it by `shift`, m, behind it, outwards, inwards, in the stance sole's axes. No map: what is
/// there is not known either. Within `footholds`, where the foot reaches, in these axes from the
/// stance sole; where that has no corners, unclipped.
Footstep AnotherPlace(const Footstep& first, int attempt, double shift, const Footstep& stance,
                      int foot, const balance::ConvexPolygon& footholds);

/// What the robot is told of the ground: steps across the way, for a lane each. Empty: nothing.
class KnownGround {
 public:
  /// From `from`, m, world x, on the ground under `foot` is `height`, m, world; in order of `from`.
  void Add(int foot, double from, double height) { edge_.push_back({foot, from, height}); }
  bool empty() const { return edge_.empty(); }
  /// m, under the middle of `foot` at x, m; 0 before the first edge.
  double At(int foot, double x) const;
  /// Between x = `rear` and `front`, m, an edge lies under `foot`.
  bool EdgeWithin(int foot, double rear, double front) const;

 private:
  struct Edge {
    int foot;
    double from, height;
  };
  std::vector<Edge> edge_;
};

}  // namespace poise::stepping
