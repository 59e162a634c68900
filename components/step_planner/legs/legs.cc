#include "components/step_planner/legs/legs.h"

#include <algorithm>
#include <cmath>

#include "components/robot/dynamics.h"
#include "components/robot/posture.h"

namespace poise::stepping {
namespace {

using Eigen::Vector3d;

constexpr double kPoint = 1e-12;  // m²: a segment so short is a point

}  // namespace

Legs::Legs(const robot::RobotModel& model) : height_(robot::StandingHeight(model)) {
  const robot::PostureGoal goal = robot::StandingGoal(model);
  robot::RobotData data(model);
  robot::ComputeKinematics(model, robot::SolvePosture(model, goal), &data);
  const Vector3d com = Vector3d(0, 0, height_) - data.base_position;
  for (const Foot f : kFeet) {
    const robot::FootModel& foot = model.feet()[f];
    const auto joints = model.supporting_joints(foot.body);
    if (joints.empty()) continue;
    const auto at = [&](int joint) -> Vector3d {
      // A joint's frame is that of the body that it carries.
      return data.body_position[static_cast<size_t>(joint) + 1];
    };
    const Vector3d ankle = at(joints.front()), hip = at(joints.back());
    const Vector3d knee = at(robot::Knee(model, data, f));
    const Vector3d sole = goal.foot[f].translation() - data.base_position;
    const Vector3d line = (ankle - hip).normalized();
    const Vector3d out = (knee - hip) - line.dot(knee - hip) * line;
    leg_[f] = {hip - com, ankle - sole, (knee - hip).norm(), (ankle - knee).norm(),
               out.x() < 0 ? -1.0 : 1.0};
  }
}

LegLine Legs::At(Foot foot, const Vector3d& sole) const {
  const Leg& leg = leg_[foot];
  LegLine line{leg.hip, leg.hip, sole + leg.ankle};
  const Vector3d whole = line.ankle - line.hip;
  // Stretched, where the body is lower or higher than it can be.
  const double length =
      std::clamp(whole.norm(), std::abs(leg.thigh - leg.shank) + 1e-9, leg.thigh + leg.shank);
  const Vector3d along = whole / std::max(whole.norm(), 1e-9);
  const double share =
      (leg.thigh * leg.thigh - leg.shank * leg.shank + length * length) / (2 * length);
  Vector3d out = Vector3d::UnitX() - along.x() * along;
  out *= leg.bent / std::max(out.norm(), 1e-9);
  const double bend = std::sqrt(std::max(0.0, leg.thigh * leg.thigh - share * share));
  line.knee = line.hip + share * along + bend * out;
  return line;
}

double Legs::Highest(Foot foot, const Eigen::Vector2d& sole, double stretch) const {
  const Leg& leg = leg_[foot];
  const double length = stretch * (leg.thigh + leg.shank);
  const double away = (sole + leg.ankle.head<2>() - leg.hip.head<2>()).norm();
  return leg.ankle.z() - leg.hip.z() + std::sqrt(std::max(0.0, length * length - away * away));
}

double SegmentDistance(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  // Both parameters where the lines are nearest, the second clamped, then the first for it, and
  // again: for two segments that is exact (Ericson 2005, 5.1.9).
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w),
               vw = v.dot(w);
  double s = 0, t = 0;
  if (uu <= kPoint && vv <= kPoint) return w.norm();
  if (uu <= kPoint) {
    t = std::clamp(vw / vv, 0.0, 1.0);
  } else if (vv <= kPoint) {
    s = std::clamp(-uw / uu, 0.0, 1.0);
  } else {
    const double determinant = uu * vv - uv * uv;
    if (determinant > kPoint * uu * vv) s = std::clamp((uv * vw - uw * vv) / determinant, 0.0, 1.0);
    t = (uv * s + vw) / vv;
    if (t < 0 || t > 1) {
      t = std::clamp(t, 0.0, 1.0);
      s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
    }
  }
  return (w + s * u - t * v).norm();
}

double LegDistance(const LegLine& a, const LegLine& b) {
  return std::min({SegmentDistance(a.hip, a.knee, b.hip, b.knee),
                   SegmentDistance(a.hip, a.knee, b.knee, b.ankle),
                   SegmentDistance(a.knee, a.ankle, b.hip, b.knee),
                   SegmentDistance(a.knee, a.ankle, b.knee, b.ankle)});
}

}  // namespace poise::stepping
