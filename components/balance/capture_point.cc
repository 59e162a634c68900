#include "components/balance/capture_point.h"

#include <cmath>

namespace poise::balance {

bool ComputeCapturePoint(const Eigen::Isometry3d& frame_o, const Eigen::Vector3d& com,
                         const Eigen::Vector3d& velocity, const Eigen::Vector3d& angular_momentum,
                         double gravity, CapturePoint* capture) {
  const Eigen::Vector3d normal = frame_o.linear().col(2);
  // Along the vertical from a point to the plane.
  const auto height = [&](const Eigen::Vector3d& point) {
    return (point - frame_o.translation()).dot(normal) / normal.z();
  };
  const double h = height(com);
  if (!(normal.z() > 0 && h > 0 && std::isfinite(h))) return false;
  const double frequency = std::sqrt(gravity / h);
  Eigen::Vector3d point = com;
  point.x() += (velocity.x() + angular_momentum.y() / h) / frequency;
  point.y() += (velocity.y() - angular_momentum.x() / h) / frequency;
  point.z() -= height(point);
  const Eigen::Vector2d position =
      (frame_o.linear().transpose() * (point - frame_o.translation())).head<2>();
  if (!position.allFinite()) return false;
  capture->position = position;
  capture->frequency = frequency;
  return true;
}

Step LatestStep(const ConvexPolygon& support, const CapturePoint& capture, double reach) {
  const Eigen::Vector2d edge = NearestPoint(support, capture.position);
  const Eigen::Vector2d beyond = capture.position - edge;
  const double distance = beyond.norm();
  if (!(distance > 0 && distance < reach)) return {capture.position, 0};
  return {edge + beyond * (reach / distance), std::log(reach / distance) / capture.frequency};
}

}  // namespace poise::balance
