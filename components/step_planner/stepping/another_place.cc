#include "components/step_planner/stepping/another_place.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "components/robot/robot_model.h"

namespace poise::stepping {

using Eigen::Vector2d;

Footstep AnotherPlace(const Footstep& first, int attempt, double shift, const Footstep& stance,
                      int foot, const balance::ConvexPolygon& footholds) {
  const double side = foot == robot::kLeftFoot ? 1 : -1;
  // Along the way first: a block that does not carry ends there as soon as to the side, and the
  // legs reach farther.
  const std::array<Vector2d, kMostPlaces> way{Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, side),
                                              Vector2d(0, -side)};
  const auto next = static_cast<size_t>(std::clamp(attempt, 1, kMostPlaces) - 1);
  const Eigen::Rotation2Dd turn(stance.yaw);
  Vector2d place = turn.inverse() * (first.position - stance.position) + shift * way[next];
  if (footholds.num_corners > 0) place = balance::NearestPoint(footholds, place);
  return {stance.position + turn * place, first.yaw};
}

double KnownGround::At(int foot, double x) const {
  double height = 0;
  for (const Edge& edge : edge_) {
    if (edge.foot == foot && x >= edge.from) height = edge.height;
  }
  return height;
}

bool KnownGround::EdgeWithin(int foot, double rear, double front) const {
  return std::any_of(edge_.begin(), edge_.end(), [&](const Edge& edge) {
    return edge.foot == foot && edge.from > rear && edge.from < front;
  });
}

}  // namespace poise::stepping
