#include "components/balance/support_polygon.h"

#include <array>

namespace poise::balance {

static_assert(ConvexPolygon::kMaxCorners == 2 * robot::kMaxSoleVertices);

ConvexPolygon SolePolygon(const robot::FootModel& foot, double margin) {
  if (foot.rectangular()) return Rectangle({0.5 * foot.length - margin, 0.5 * foot.width - margin});
  return Inset(ConvexHull(foot.vertices), margin);
}

ConvexPolygon SolePolygon(const robot::FootModel& foot, double margin, double side_margin) {
  if (foot.rectangular()) {
    return Rectangle({0.5 * foot.length - margin, 0.5 * foot.width - side_margin});
  }
  ConvexPolygon rest = SolePolygon(foot, 0);
  const HalfPlanes edges = EdgesOf(rest);
  for (HalfPlane plane : edges.planes()) {
    plane.offset -= plane.normal.cwiseProduct(Eigen::Vector2d(margin, side_margin)).norm();
    rest = Clip(rest, plane);
  }
  return rest;
}

ConvexPolygon SupportPolygon(const Eigen::Isometry3d& frame_o, const ContactGeometry& geometry,
                             const FootArray<ConvexPolygon>& sole) {
  std::array<Eigen::Vector2d, ConvexPolygon::kMaxCorners> corner;
  size_t count = 0;
  for (const Foot foot : kFeet) {
    if (!geometry.in_contact[foot]) continue;
    for (const Eigen::Vector2d& at : sole[foot].corners()) {
      if (count == corner.size()) break;
      const Eigen::Vector3d world = geometry.sole[foot] * Eigen::Vector3d(at.x(), at.y(), 0);
      corner[count++] = (frame_o.linear().transpose() * (world - frame_o.translation())).head<2>();
    }
  }
  return ConvexHull({corner.data(), count});
}

}  // namespace poise::balance
