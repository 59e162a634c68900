// What is known of the ground's height.
#pragma once

#include <vector>

#include "components/step_planner/legs/feet.h"

namespace poise::stepping {

/// The ground's height along world x, for each foot, as configured. Empty: it is level or not
/// known.
class KnownGround {
 public:
  /// From `from`, m, world x, on the ground under `foot` is `height`, m, world; in order of `from`.
  void Add(Foot foot, double from, double height) { edge_.push_back({foot, from, height}); }
  bool empty() const { return edge_.empty(); }
  /// m, under the middle of `foot` at x, m; 0 before the first edge.
  double At(Foot foot, double x) const {
    double height = 0;
    for (const Edge& edge : edge_) {
      if (edge.foot == foot && x >= edge.from) height = edge.height;
    }
    return height;
  }

 private:
  struct Edge {
    Foot foot;
    double from, height;
  };
  std::vector<Edge> edge_;
};

}  // namespace poise::stepping
