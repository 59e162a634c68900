#include "components/balance/support_polygon.h"

namespace poise::balance {

ConvexPolygon SupportPolygon(const Eigen::Isometry3d& frame_o, const ContactGeometry& geometry,
                             const std::array<Eigen::Vector2d, 2>& half) {
  std::array<Eigen::Vector2d, 8> corner;
  size_t count = 0;
  for (size_t foot = 0; foot < 2; ++foot) {
    if (!geometry.in_contact[foot]) continue;
    for (const double x : {-half[foot].x(), half[foot].x()}) {
      for (const double y : {-half[foot].y(), half[foot].y()}) {
        const Eigen::Vector3d world = geometry.sole[foot] * Eigen::Vector3d(x, y, 0);
        corner[count++] =
            (frame_o.linear().transpose() * (world - frame_o.translation())).head<2>();
      }
    }
  }
  return ConvexHull({corner.data(), count});
}

}  // namespace poise::balance
