#include "components/balance/contact_conditions.h"

#include <cmath>

namespace poise::balance {

bool ContactMargins::Met(double tolerance) const {
  return normal >= -tolerance && friction >= -tolerance && yaw >= -tolerance &&
         roll >= -tolerance && pitch >= -tolerance;
}

ContactMargins CheckContact(const Vector6d& wrench, const ContactLimits& limits) {
  const double load = std::abs(wrench(2));
  ContactMargins margins;
  margins.normal = -wrench(2);
  margins.friction = limits.friction * load - std::hypot(wrench(0), wrench(1));
  margins.yaw = limits.yaw_friction * load - std::abs(wrench(5));
  margins.roll = limits.half_width * load - std::abs(wrench(3));
  margins.pitch = limits.half_length * load - std::abs(wrench(4));
  if (limits.edges.count > 0) {
    double least = HUGE_VAL;
    for (const HalfPlane& edge : limits.edges.planes()) {
      // |F_z| normal·r with (37), (38) for F_z < 0.
      const double moment = edge.normal.x() * wrench(4) - edge.normal.y() * wrench(3);
      const double margin = edge.offset * load - moment;
      if (!(margin >= least)) least = margin;  // NaN, too
    }
    margins.roll = margins.pitch = least;
  }
  return margins;
}

Eigen::Vector2d CenterOfPressure(const Vector6d& wrench) {
  return {-wrench(4) / wrench(2), wrench(3) / wrench(2)};
}

bool FrameO(const FootArray<Eigen::Isometry3d>& sole, const FootArray<bool>& in_contact,
            Eigen::Isometry3d* frame) {
  if (!in_contact[Foot::kRight] || !in_contact[Foot::kLeft]) {
    const Foot foot = in_contact[Foot::kRight] ? Foot::kRight : Foot::kLeft;
    if (!in_contact[foot] || !sole[foot].matrix().allFinite()) return false;
    *frame = sole[foot];
    return true;
  }
  constexpr double kCoincident = 1e-6;  // m
  constexpr double kParallel = 1e-6;    // sine
  const Eigen::Isometry3d &right = sole[Foot::kRight], &left = sole[Foot::kLeft];
  const Eigen::Vector3d line = left.translation() - right.translation();
  const double distance = line.norm();
  const Eigen::Vector3d normal = right.linear().col(2) + left.linear().col(2);
  if (!(distance > kCoincident && distance < HUGE_VAL)) return false;
  const Eigen::Vector3d y = line / distance;
  const Eigen::Vector3d upright = normal - y * y.dot(normal);
  const double height = upright.norm();
  if (!(height > kParallel && height < HUGE_VAL)) return false;
  const Eigen::Vector3d z = upright / height;
  frame->linear() << y.cross(z), y, z;
  frame->translation() = right.translation() + line / 2;
  frame->makeAffine();
  return true;
}

Matrix6d WrenchTransform(const Eigen::Isometry3d& frame, const Eigen::Isometry3d& sole) {
  const Eigen::Matrix3d to_frame = frame.linear().transpose();
  const Eigen::Matrix3d r = to_frame * sole.linear();
  const Eigen::Vector3d p = to_frame * (sole.translation() - frame.translation());
  Matrix6d k;
  k.topLeftCorner<3, 3>() = r;
  k.topRightCorner<3, 3>().setZero();
  for (int i = 0; i < 3; ++i) k.block<3, 1>(3, i) = p.cross(r.col(i));
  k.bottomRightCorner<3, 3>() = r;
  return k;
}

}  // namespace poise::balance
