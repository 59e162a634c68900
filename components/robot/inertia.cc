#include "components/robot/inertia.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

namespace poise::robot {
namespace {

// Three printed digits can be off by this share of the largest principal moment.
constexpr double kRoundingTolerance = 1e-3;
constexpr double kDefiniteTolerance = 1e-9;
// Beyond them a unit is mistaken, and products stop being finite.
constexpr double kMaxMass = 1e6;    // kg
constexpr double kMaxMoment = 1e9;  // kg·m²

Eigen::Matrix3d PointInertia(double mass, const Eigen::Vector3d& d) {
  return mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
}

// Ascending.
Eigen::Vector3d PrincipalMoments(const Eigen::Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

bool AllFinite(const MassProperties& part) {
  return std::isfinite(part.mass) && part.com.allFinite() && part.inertia.allFinite();
}

}  // namespace

MassProperties Transformed(const MassProperties& part, const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  return {part.mass, pose * part.com, r * part.inertia * r.transpose()};
}

MassProperties Merged(const std::vector<MassProperties>& parts) {
  MassProperties body;
  for (const MassProperties& part : parts) {
    body.mass += part.mass;
    body.com += part.mass * part.com;
  }
  if (body.mass > 0) body.com /= body.mass;
  for (const MassProperties& part : parts) {
    body.inertia += part.inertia + PointInertia(part.mass, part.com - body.com);
  }
  return body;
}

std::string WhyImpossible(const MassProperties& part) {
  if (!AllFinite(part)) return "mass, centre of mass or inertia is not finite";
  if (part.mass < 0) return fmt::format("mass {} kg is negative", part.mass);
  if (part.mass > kMaxMass) return fmt::format("mass {} kg is over {:g} kg", part.mass, kMaxMass);
  if (part.inertia.cwiseAbs().maxCoeff() > kMaxMoment) {
    return fmt::format("inertia has an entry over {:g} kg m^2", kMaxMoment);
  }
  const Eigen::Vector3d moments = PrincipalMoments(part.inertia);
  const double tolerance = kRoundingTolerance * moments[2];
  if (moments[0] < -kDefiniteTolerance * std::abs(moments[2]) || moments[2] < 0) {
    return fmt::format("inertia is not positive (smallest principal moment {:.3g} kg m^2)",
                       moments[0]);
  }
  if (moments[0] + moments[1] < moments[2] - tolerance) {
    return fmt::format(
        "inertia breaks the triangle inequality (principal moments {:.4g} + {:.4g} < {:.4g} kg "
        "m^2)",
        moments[0], moments[1], moments[2]);
  }
  return "";
}

std::string WhyImmovable(const MassProperties& body) {
  if (!AllFinite(body)) return "mass, centre of mass or inertia is not finite";
  if (body.mass <= 0) return fmt::format("mass is {} kg", body.mass);
  const Eigen::Vector3d moments = PrincipalMoments(body.inertia);
  if (moments[0] <= kDefiniteTolerance * moments[2]) {
    return fmt::format(
        "inertia is not positive definite (principal moments {:.3g}, {:.3g}, {:.3g} kg m^2)",
        moments[0], moments[1], moments[2]);
  }
  return "";
}

}  // namespace poise::robot
