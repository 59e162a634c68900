#include "components/balance/distribution_ratio.h"

#include <algorithm>
#include <cmath>

namespace poise::balance {
namespace {

/// |a η + b| < c of one foot and axis, (70).
struct Bound {
  double a, b, c;
  const char* name;
};

/// Moments about the soles' own centres, in O: slope·η + offset, (68), (71), (72), (74), (75),
/// (77), (78).
struct LinearMoment {
  Eigen::Vector3d slope, offset;
};

LinearMoment OwnMoments(const Vector6d& resultant, const Eigen::Vector3d& right,
                        const Eigen::Vector3d& left) {
  const Eigen::Vector3d force = resultant.head<3>();
  return {-(right - left).cross(force), resultant.tail<3>() - left.cross(force)};
}

using Bounds = std::array<Bound, 6>;

/// (70)–(79) of both feet, each in its own sole frame. `rotation`: sole to O.
Bounds MomentBounds(const Vector6d& resultant, const std::array<Eigen::Vector3d, 2>& position,
                    const std::array<Eigen::Matrix3d, 2>& rotation, const ContactLimits& limits) {
  const LinearMoment moment = OwnMoments(resultant, position[0], position[1]);
  Bounds bounds;
  for (int foot = 0; foot < 2; ++foot) {
    const Eigen::Matrix3d to_sole = rotation[foot].transpose();
    const Eigen::Vector3d a = to_sole * moment.slope, b = to_sole * moment.offset;
    const double load = std::abs(to_sole.row(2).dot(resultant.head<3>()));
    bounds[3 * foot] = {a.x(), b.x(), limits.half_width * load, "roll"};
    bounds[3 * foot + 1] = {a.y(), b.y(), limits.half_length * load, "pitch"};
    bounds[3 * foot + 2] = {a.z(), b.z(), limits.yaw_friction * load, "yaw"};
  }
  return bounds;
}

RatioInterval Intersect(const Vector6d& resultant, const std::array<Eigen::Vector3d, 2>& position,
                        const std::array<Eigen::Matrix3d, 2>& rotation, const ContactLimits& limits,
                        double eta_min, double eta_max) {
  RatioInterval interval;
  const LinearMoment moment = OwnMoments(resultant, position[0], position[1]);
  const double optimal = -moment.offset.x() / moment.slope.x();
  if (std::isfinite(optimal)) interval.optimal = optimal;
  interval.min = std::max(eta_min, 0.0);
  interval.max = std::min(eta_max, 1.0);
  const auto infeasible = [&](const char* condition) {
    interval.min = 0;
    interval.max = 1;
    interval.feasible = false;
    interval.limiting_condition = condition;
    return interval;
  };
  if (!(interval.min <= interval.max)) return infeasible("ratio limits");
  for (const Eigen::Matrix3d& r : rotation) {
    const Eigen::Vector3d force = r.transpose() * resultant.head<3>();
    if (!(force.z() < 0)) return infeasible("normal");
    if (!(std::hypot(force.x(), force.y()) < limits.friction * -force.z()))
      return infeasible("friction");
  }
  for (const Bound& bound : MomentBounds(resultant, position, rotation, limits)) {
    if (bound.a == 0) {
      if (!(std::abs(bound.b) < bound.c)) return infeasible(bound.name);
      continue;
    }
    const double one = (-bound.c - bound.b) / bound.a, other = (bound.c - bound.b) / bound.a;
    interval.min = std::max(std::min(one, other), interval.min);
    interval.max = std::min(std::max(one, other), interval.max);
    // NaN passes neither std::max nor std::min as written; it is caught here.
    if (!(std::isfinite(bound.a + bound.b) && interval.min <= interval.max))
      return infeasible(bound.name);
  }
  interval.feasible = true;
  return interval;
}

// m of centre of pressure that one ratio may be worse than another before it counts.
constexpr double kIndifference = 1e-3;

double Violation(const Bounds& bounds, double eta) {
  double worst = -HUGE_VAL;
  for (const Bound& bound : bounds)
    worst = std::max(worst, std::abs(bound.a * eta + bound.b) - bound.c);
  return worst;
}

double Select(const RatioInterval& interval, const Vector6d& resultant,
              const std::array<Eigen::Vector3d, 2>& position,
              const std::array<Eigen::Matrix3d, 2>& rotation, const ContactLimits& limits,
              double eta_min, double eta_max) {
  if (interval.feasible) return std::clamp(interval.optimal, interval.min, interval.max);
  // The largest violation is convex and piecewise linear in η: its minimum is at an end or where
  // two pieces meet.
  const Bounds bounds = MomentBounds(resultant, position, rotation, limits);
  double best = eta_min, least = Violation(bounds, eta_min);
  const auto consider = [&](double eta) {
    if (!(eta >= eta_min && eta <= eta_max)) return;
    const double violation = Violation(bounds, eta);
    if (violation < least) {
      least = violation;
      best = eta;
    }
  };
  consider(eta_max);
  for (size_t i = 0; i < bounds.size(); ++i) {
    const Bound& p = bounds[i];
    consider(-p.b / p.a);
    for (size_t j = i + 1; j < bounds.size(); ++j) {
      const Bound& q = bounds[j];
      // ±(p.a η + p.b) − p.c = q.a η + q.b − q.c and the same with −q.
      for (const double sign : {1.0, -1.0}) {
        const double a = sign * q.a, b = sign * q.b;
        consider((b - p.b + p.c - q.c) / (p.a - a));
        consider((-b - p.b - p.c + q.c) / (p.a + a));
      }
    }
  }
  // Side by side the soles lack as much at any η: noise alone would tell the best, and η, with the
  // joints' torques, jump from end to end. Of what is as good, the nearest to η*.
  const double lacking = least + kIndifference * resultant.head<3>().norm();
  double lower = eta_min, upper = eta_max;
  for (const Bound& bound : bounds) {
    if (bound.a == 0) continue;
    const double half = (bound.c + lacking) / std::abs(bound.a), middle = -bound.b / bound.a;
    lower = std::max(lower, middle - half);
    upper = std::min(upper, middle + half);
  }
  return lower <= upper ? std::clamp(interval.optimal, lower, upper) : best;
}

std::array<Eigen::Matrix3d, 2> Level() {
  return {Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity()};
}

std::array<Eigen::Vector3d, 2> Positions(const std::array<Eigen::Isometry3d, 2>& foot) {
  return {foot[0].translation(), foot[1].translation()};
}

std::array<Eigen::Matrix3d, 2> Rotations(const std::array<Eigen::Isometry3d, 2>& foot) {
  return {foot[0].linear(), foot[1].linear()};
}

}  // namespace

RatioInterval FeasibleRatio(const Vector6d& resultant,
                            const std::array<Eigen::Vector3d, 2>& foot_in_o,
                            const ContactLimits& limits, double eta_min, double eta_max) {
  return Intersect(resultant, foot_in_o, Level(), limits, eta_min, eta_max);
}

RatioInterval FeasibleRatio(const Vector6d& resultant, const std::array<Eigen::Isometry3d, 2>& foot,
                            const ContactLimits& limits, double eta_min, double eta_max) {
  return Intersect(resultant, Positions(foot), Rotations(foot), limits, eta_min, eta_max);
}

double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const std::array<Eigen::Vector3d, 2>& foot_in_o, const ContactLimits& limits,
                   double eta_min, double eta_max) {
  return Select(interval, resultant, foot_in_o, Level(), limits, eta_min, eta_max);
}

double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const std::array<Eigen::Isometry3d, 2>& foot, const ContactLimits& limits,
                   double eta_min, double eta_max) {
  return Select(interval, resultant, Positions(foot), Rotations(foot), limits, eta_min, eta_max);
}

std::array<Vector6d, 2> DistributeResultant(const Vector6d& resultant,
                                            const std::array<Eigen::Isometry3d, 2>& foot,
                                            double eta) {
  const LinearMoment own = OwnMoments(resultant, foot[0].translation(), foot[1].translation());
  const Eigen::Vector3d moment = own.slope * eta + own.offset;
  const Eigen::Vector3d force = resultant.head<3>();
  std::array<Vector6d, 2> share;
  for (int i = 0; i < 2; ++i) {
    const double part = i == 0 ? eta : 1 - eta;
    share[i].head<3>() = foot[i].linear().transpose() * (force * part);
    share[i].tail<3>() = foot[i].linear().transpose() * (moment * part);
  }
  return share;
}

}  // namespace poise::balance
