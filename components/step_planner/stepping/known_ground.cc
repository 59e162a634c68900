#include "components/step_planner/stepping/known_ground.h"

#include <algorithm>

namespace poise::stepping {

double KnownGround::At(Foot foot, double x) const {
  double height = 0;
  for (const Edge& edge : edge_) {
    if (edge.foot == foot && x >= edge.from) height = edge.height;
  }
  return height;
}

bool KnownGround::EdgeWithin(Foot foot, double rear, double front) const {
  return std::any_of(edge_.begin(), edge_.end(), [&](const Edge& edge) {
    return edge.foot == foot && edge.from > rear && edge.from < front;
  });
}

}  // namespace poise::stepping
