#include "components/step_planner/stepping/known_ground.h"

namespace poise::stepping {

double KnownGround::At(Foot foot, double x) const {
  double height = 0;
  for (const Edge& edge : edge_) {
    if (edge.foot == foot && x >= edge.from) height = edge.height;
  }
  return height;
}

}  // namespace poise::stepping
