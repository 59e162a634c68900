#include "components/balance/distribution_ratio.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace poise::balance {
namespace {

/// a η + b < c of one foot, one half of (70).
struct Bound {
  double a, b, c;
  const char* name;
};

/// Moments about the soles' own centres, in O: slope·η + offset, (68), (71), (72), (74), (75),
/// (77), (78).
struct LinearMoment {
  Eigen::Vector3d slope, offset;
};

LinearMoment OwnMoments(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& position) {
  const Eigen::Vector3d &right = position[Foot::kRight], &left = position[Foot::kLeft];
  const Eigen::Vector3d force = resultant.head<3>();
  return {-(right - left).cross(force), resultant.tail<3>() - left.cross(force)};
}

/// Both feet bound the ratio: by the edges of their soles, and by M_z both ways.
class Bounds {
 public:
  void AddBelow(double a, double b, double c, const char* name) {
    bound_[static_cast<size_t>(count_++)] = {a, b, c, name};
  }
  /// |a η + b| < c.
  void AddBoth(double a, double b, double c, const char* name) {
    AddBelow(a, b, c, name);
    AddBelow(-a, -b, c, name);
  }
  const Bound* begin() const { return bound_.data(); }
  const Bound* end() const { return bound_.data() + count_; }

 private:
  static constexpr int kMost = 2 * (ConvexPolygon::kMaxCorners + 2);
  std::array<Bound, kMost> bound_;
  int count_ = 0;
};

/// (70)–(79) of both feet, each in its own sole frame. `rotation`: sole to O.
Bounds MomentBounds(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& position,
                    const FootArray<Eigen::Matrix3d>& rotation, const SoleLimits& limits) {
  const LinearMoment moment = OwnMoments(resultant, position);
  Bounds bounds;
  for (const Foot foot : kFeet) {
    const ContactLimits& own = limits[foot];
    const Eigen::Matrix3d to_sole = rotation[foot].transpose();
    const Eigen::Vector3d a = to_sole * moment.slope, b = to_sole * moment.offset;
    const double load = std::abs(to_sole.row(2).dot(resultant.head<3>()));
    if (own.edges.count == 0) {
      bounds.AddBoth(a.x(), b.x(), own.half_width * load, "roll");
      bounds.AddBoth(a.y(), b.y(), own.half_length * load, "pitch");
    }
    for (const HalfPlane& edge : own.edges.planes()) {
      // |F_z| normal·r with (37), (38) for F_z < 0.
      const Eigen::Vector2d turned(-edge.normal.y(), edge.normal.x());
      bounds.AddBelow(turned.dot(a.head<2>()), turned.dot(b.head<2>()), edge.offset * load, "edge");
    }
    bounds.AddBoth(a.z(), b.z(), own.yaw_friction * load, "yaw");
  }
  return bounds;
}

// m that a sole's reach is short of its edge, so that an area is left to MoveIntoSoles: what M_z of
// soles tilted by 0.02 rad has about x and y.
constexpr double kReachReserve = 5e-4;

/// MomentBounds where each foot has a centre of pressure of its own: η S_r + (1 − η) S_l holds what
/// both can have together. S is the polygon of moments (x, y in O) that the whole force has about a
/// sole's centre from within that sole, which may be tilted, and the sum reaches along the normal
/// of each edge of either as far as η h_r + (1 − η) h_l.
Bounds FreeMomentBounds(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& position,
                        const FootArray<Eigen::Matrix3d>& rotation, const SoleLimits& limits,
                        const FootArray<ConvexPolygon>& sole) {
  const LinearMoment own = OwnMoments(resultant, position);
  const Eigen::Vector3d force = resultant.head<3>();
  FootArray<Eigen::Matrix2d> moment;  // of a point of each sole, m, its frame: N
  for (const Foot foot : kFeet) {
    for (const int axis : {0, 1}) {
      moment[foot].col(axis) = rotation[foot].col(axis).cross(force).head<2>();
    }
  }
  Bounds bounds;
  for (const Foot foot : kFeet) {
    for (const HalfPlane& edge : limits[foot].edges.planes()) {
      const Eigen::Vector2d along =
          moment[foot] * Eigen::Vector2d(-edge.normal.y(), edge.normal.x());
      Eigen::Vector2d normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
      if (normal.dot(moment[foot] * edge.normal) < 0) normal = -normal;
      const auto reach = [&](Foot of) {
        const Eigen::Vector2d in_sole = moment[of].transpose() * normal;
        double most = -HUGE_VAL;
        for (const Eigen::Vector2d& corner : sole[of].corners()) {
          most = std::max(most, in_sole.dot(corner));
        }
        return most - kReachReserve * in_sole.norm();
      };
      const double right = reach(Foot::kRight), left = reach(Foot::kLeft);
      bounds.AddBelow(normal.dot(own.slope.head<2>()) - (right - left),
                      normal.dot(own.offset.head<2>()), left, "edge");
    }
    const Eigen::Matrix3d to_sole = rotation[foot].transpose();
    bounds.AddBoth(to_sole.row(2).dot(own.slope), to_sole.row(2).dot(own.offset),
                   limits[foot].yaw_friction * std::abs(to_sole.row(2).dot(force)), "yaw");
  }
  return bounds;
}

/// `bounds`: of the moments, made once the force is known to press.
template <class MakeBounds>
RatioInterval Intersect(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& position,
                        const FootArray<Eigen::Matrix3d>& rotation, const SoleLimits& limits,
                        double eta_min, double eta_max, const MakeBounds& bounds) {
  RatioInterval interval;
  const LinearMoment moment = OwnMoments(resultant, position);
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
  for (const Foot foot : kFeet) {
    const Eigen::Vector3d force = rotation[foot].transpose() * resultant.head<3>();
    if (!(force.z() < 0)) return infeasible("normal");
    if (!(std::hypot(force.x(), force.y()) < limits[foot].friction * -force.z()))
      return infeasible("friction");
  }
  for (const Bound& bound : bounds()) {
    if (bound.a == 0) {
      if (!(bound.b < bound.c)) return infeasible(bound.name);
      continue;
    }
    const double end = (bound.c - bound.b) / bound.a;
    if (bound.a > 0) interval.max = std::min(end, interval.max);
    if (bound.a < 0) interval.min = std::max(end, interval.min);
    // NaN passes neither std::max nor std::min as written; it is caught here.
    if (!(std::isfinite(bound.a + bound.b) && interval.min <= interval.max))
      return infeasible(bound.name);
  }
  interval.feasible = true;
  return interval;
}

RatioInterval Intersect(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& position,
                        const FootArray<Eigen::Matrix3d>& rotation, const SoleLimits& limits,
                        double eta_min, double eta_max) {
  return Intersect(resultant, position, rotation, limits, eta_min, eta_max,
                   [&] { return MomentBounds(resultant, position, rotation, limits); });
}

// m of centre of pressure that one ratio may be worse than another before it counts.
constexpr double kIndifference = 1e-3;

double Violation(const Bound& bound, double eta) { return bound.a * eta + bound.b - bound.c; }

/// The bound that η violates most.
const Bound& Worst(const Bounds& bounds, double eta) {
  const Bound* worst = bounds.begin();
  for (const Bound& bound : bounds) {
    if (Violation(bound, eta) > Violation(*worst, eta)) worst = &bound;
  }
  return *worst;
}

/// The least that the largest violation can be in [eta_min, eta_max]: the lowest point of a convex,
/// piecewise linear function, between a piece that falls and one that rises.
double LeastViolation(const Bounds& bounds, double eta_min, double eta_max) {
  const Bound *fall = &Worst(bounds, eta_min), *rise = &Worst(bounds, eta_max);
  if (!(fall->a < 0)) return Violation(*fall, eta_min);
  if (!(rise->a > 0)) return Violation(*rise, eta_max);
  double least = std::min(Violation(*fall, eta_min), Violation(*rise, eta_max));
  // Each pass takes a piece that was none of the two.
  for (const Bound* pass = bounds.begin(); pass != bounds.end(); ++pass) {
    const Bound &p = *std::min(fall, rise), &q = *std::max(fall, rise);
    const double eta = (q.b - p.b + p.c - q.c) / (p.a - q.a);
    if (!(eta >= eta_min && eta <= eta_max)) break;
    const Bound& worst = Worst(bounds, eta);
    least = std::min(least, Violation(worst, eta));
    if (&worst == fall || &worst == rise) break;
    (worst.a < 0 ? fall : rise) = &worst;
  }
  return least;
}

double Select(const RatioInterval& interval, const Vector6d& resultant,
              const FootArray<Eigen::Vector3d>& position,
              const FootArray<Eigen::Matrix3d>& rotation, const SoleLimits& limits, double eta_min,
              double eta_max) {
  if (interval.feasible) return std::clamp(interval.optimal, interval.min, interval.max);
  const Bounds bounds = MomentBounds(resultant, position, rotation, limits);
  // Side by side the soles lack as much at any η: noise alone would tell the best, and η would jump
  // from end to end with the joints' torques. What is nearly as good counts as good, and the
  // nearest of it to η* is taken.
  const double lacking =
      LeastViolation(bounds, eta_min, eta_max) + kIndifference * resultant.head<3>().norm();
  double lower = eta_min, upper = eta_max;
  for (const Bound& bound : bounds) {
    if (bound.a == 0) continue;
    const double half = (bound.c + lacking) / std::abs(bound.a), middle = -bound.b / bound.a;
    if (bound.a < 0) lower = std::max(lower, middle - half);
    if (bound.a > 0) upper = std::min(upper, middle + half);
  }
  // `lower` is above `upper` only where numbers are not finite.
  return lower <= upper ? std::clamp(interval.optimal, lower, upper) : eta_min;
}

FootArray<Eigen::Matrix3d> Level() {
  return FootArray<Eigen::Matrix3d>(Eigen::Matrix3d::Identity());
}

FootArray<Eigen::Vector3d> Positions(const FootArray<Eigen::Isometry3d>& foot) {
  return {foot[Foot::kRight].translation(), foot[Foot::kLeft].translation()};
}

FootArray<Eigen::Matrix3d> Rotations(const FootArray<Eigen::Isometry3d>& foot) {
  return {foot[Foot::kRight].linear(), foot[Foot::kLeft].linear()};
}

}  // namespace

RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                            const SoleLimits& limits, double eta_min, double eta_max) {
  return Intersect(resultant, Positions(foot), Rotations(foot), limits, eta_min, eta_max);
}

RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                            const ContactLimits& limits, double eta_min, double eta_max) {
  return FeasibleRatio(resultant, foot, SoleLimits(limits), eta_min, eta_max);
}

RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& foot_in_o,
                            const ContactLimits& limits, double eta_min, double eta_max) {
  return Intersect(resultant, foot_in_o, Level(), SoleLimits(limits), eta_min, eta_max);
}

RatioInterval FreeRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                        const SoleLimits& limits, const FootArray<ConvexPolygon>& sole,
                        double eta_min, double eta_max) {
  const auto position = Positions(foot);
  const auto rotation = Rotations(foot);
  return Intersect(resultant, position, rotation, limits, eta_min, eta_max,
                   [&] { return FreeMomentBounds(resultant, position, rotation, limits, sole); });
}

double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Isometry3d>& foot, const SoleLimits& limits,
                   double eta_min, double eta_max) {
  return Select(interval, resultant, Positions(foot), Rotations(foot), limits, eta_min, eta_max);
}

double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Isometry3d>& foot, const ContactLimits& limits,
                   double eta_min, double eta_max) {
  return SelectRatio(interval, resultant, foot, SoleLimits(limits), eta_min, eta_max);
}

double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Vector3d>& foot_in_o, const ContactLimits& limits,
                   double eta_min, double eta_max) {
  return Select(interval, resultant, foot_in_o, Level(), SoleLimits(limits), eta_min, eta_max);
}

FootArray<Vector6d> DistributeResultant(const Vector6d& resultant,
                                        const FootArray<Eigen::Isometry3d>& foot, double eta) {
  const LinearMoment own = OwnMoments(resultant, Positions(foot));
  const Eigen::Vector3d moment = own.slope * eta + own.offset;
  const Eigen::Vector3d force = resultant.head<3>();
  FootArray<Vector6d> share;
  for (const Foot of : kFeet) {
    const double part = of == Foot::kRight ? eta : 1 - eta;
    share[of].head<3>() = foot[of].linear().transpose() * (force * part);
    share[of].tail<3>() = foot[of].linear().transpose() * (moment * part);
  }
  return share;
}

void MoveIntoSoles(const FootArray<Eigen::Isometry3d>& foot, const FootArray<ConvexPolygon>& sole,
                   FootArray<Vector6d>* share) {
  FootArray<Vector6d>& wrench = *share;
  const double right = wrench[Foot::kRight](2), left = wrench[Foot::kLeft](2);
  if (!(right < 0 && left < 0)) return;
  const Foot light = right > left ? Foot::kRight : Foot::kLeft, heavy = Other(light);
  const Eigen::Vector2d from = CenterOfPressure(wrench[light]),
                        other = CenterOfPressure(wrench[heavy]);
  if (!from.allFinite() || !other.allFinite()) return;
  // (M_x, M_y) = F_z turn r. A moment that the lighter foot gets, the heavier one loses.
  const Eigen::Matrix3d to_heavy = foot[heavy].linear().transpose() * foot[light].linear();
  Eigen::Matrix2d turn;
  turn << 0, 1, -1, 0;
  const Eigen::Matrix2d follows =
      wrench[light](2) / wrench[heavy](2) * turn * to_heavy.topLeftCorner<2, 2>() * turn;
  ConvexPolygon both = sole[light];  // where the lighter's may be so that the heavier's is inside
  const HalfPlanes edges = EdgesOf(sole[heavy]);
  for (const HalfPlane& edge : edges.planes()) {
    const Eigen::Vector2d normal = follows.transpose() * edge.normal;
    const double norm = normal.norm();
    if (!(norm > 0)) continue;
    const double offset = edge.offset - edge.normal.dot(other) + normal.dot(from);
    both = Clip(both, {normal / norm, offset / norm});
  }
  const Eigen::Vector2d change =
      NearestPoint(both.num_corners > 0 ? both : sole[light], from) - from;
  const double force = wrench[light](2);
  const Eigen::Vector3d moment(force * change.y(), -force * change.x(), 0);
  wrench[light].tail<3>() += moment;
  wrench[heavy].tail<3>() -= to_heavy * moment;
}

}  // namespace poise::balance
