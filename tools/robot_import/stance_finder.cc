#include "tools/robot_import/stance_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "tools/robot/standing_loads.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using robot::RobotModel;

// rad, between thigh and shank: far enough from the straight leg, where no torque lifts the COM.
constexpr std::array kBends = {0.6, 0.5, 0.7, 0.4, 0.8, 0.9};
constexpr double kLateral = 0.7;        // cosine: a joint about the lateral axis
constexpr double kLimitShare = 0.1;     // of its range, that a joint keeps from its limits
constexpr double kMostMargin = 0.15;    // rad, at most
constexpr double kRounding = 1e4;       // steps in a metre that a text has
constexpr double kJointRounding = 1e3;  // in a radian

// A leg's joint may bear this share of its torque limit on one foot: a step takes more than
// standing.
constexpr double kComfort = 0.9;
// The feet come nearer by this share of the nominal posture's spacing at a time, so often.
constexpr double kNarrowing = 0.05;
constexpr int kNarrowings = 7;
constexpr double kLeastGap = 0.04;  // m between the soles

double Rounded(double value, double steps = kRounding) { return std::round(value * steps) / steps; }

/// rad about y, from `a` to `b` in the sagittal plane.
double PitchBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.z() * b.x() - a.x() * b.z(), a.x() * b.x() + a.z() * b.z());
}

/// Bends the leg's knee by `bend` rad in all, hip and ankle turned so that the foot stays below the
/// hip and level. A leg without a knee about the lateral axis stays as it is.
void BendLeg(const RobotModel& model, const Anatomy& anatomy, robot::Foot foot, double bend,
             Eigen::VectorXd* joints) {
  const Leg& leg = anatomy.leg[foot];
  const robot::RobotData data = robot::Evaluate(model, *joints);
  struct Pitch {
    int joint;
    double sign;
    Vector3d place;
  };
  std::vector<Pitch> pitch;
  for (const int j : leg.joints) {
    const auto body = static_cast<size_t>(model.joints()[static_cast<size_t>(j)].body);
    const Vector3d axis = data.body_rotation[body] * model.joints()[static_cast<size_t>(j)].axis;
    if (std::abs(axis.y()) < kLateral) continue;
    pitch.push_back({j, axis.y() > 0 ? 1.0 : -1.0, data.body_position[body]});
  }
  if (pitch.size() < 3) return;
  const Pitch& hip = pitch.front();
  const Pitch& ankle = pitch.back();
  const auto nearest_end = [&](const Pitch& p) {
    return std::min((p.place - hip.place).norm(), (p.place - ankle.place).norm());
  };
  const Pitch& knee = *std::max_element(
      pitch.begin() + 1, pitch.end() - 1,
      [&](const Pitch& a, const Pitch& b) { return nearest_end(a) < nearest_end(b); });
  const Vector3d thigh = knee.place - hip.place, shank = ankle.place - knee.place;
  const double bent = PitchBetween(thigh, shank);
  // Forward knees, or backward ones where the joint does not bend the other way.
  const auto& limits = model.joints()[static_cast<size_t>(knee.joint)];
  const double margin = std::min(kMostMargin, kLimitShare * (limits.upper - limits.lower));
  double turn = bend - bent;
  const auto reaches = [&](double angle) {
    const double q = (*joints)[knee.joint] + knee.sign * angle;
    return q > limits.lower + margin && q < limits.upper - margin;
  };
  if (!reaches(turn) && reaches(-bend - bent)) turn = -bend - bent;
  // The foot stays below the hip.
  const Vector3d folded = thigh + Eigen::AngleAxisd(turn, Vector3d::UnitY()) * shank;
  const double lean = PitchBetween(folded, Vector3d(0, 0, -1));
  (*joints)[knee.joint] += knee.sign * turn;
  (*joints)[hip.joint] += hip.sign * lean;
  // The sole ends level, also where a limit kept the leg from its zero.
  const Vector3d toe = data.foot_pose[foot].linear().col(0);
  (*joints)[ankle.joint] -= ankle.sign * (turn + lean + std::atan2(-toe.z(), toe.x()));
}

/// The stance with soles that are `spacing` apart, m.
FoundStance StanceAt(const RobotModel& model, const Anatomy& anatomy,
                     const Eigen::VectorXd& nominal, bool bend_knees, double spacing) {
  std::string problem;
  for (const double bend : kBends) {
    robot::PostureGoal goal;
    goal.nominal = nominal;
    if (bend_knees) {
      for (const robot::Foot f : robot::kFeet) BendLeg(model, anatomy, f, bend, &goal.nominal);
      goal.nominal = WithinLimits(model, goal.nominal);
    }
    const robot::RobotData data = robot::Evaluate(model, goal.nominal);
    goal.com_height = Rounded(data.com.z() - 0.5 * (data.foot_pose[0].translation().z() +
                                                    data.foot_pose[1].translation().z()));
    for (const robot::Foot f : robot::kFeet) {
      goal.foot[f] = Eigen::Isometry3d(Eigen::Translation3d(0, Side(f) * spacing / 2, 0));
    }
    try {
      FoundStance found;
      found.state = robot::SolvePosture(model, goal);
      found.com_height = goal.com_height;
      found.foot_spacing = spacing;
      found.joint_position = found.state.joint_position;
      for (double& q : found.joint_position) q = Rounded(q, kJointRounding);
      return found;
    } catch (const robot::RobotError& error) {
      if (problem.empty()) problem = error.what();
    }
    if (!bend_knees) break;
  }
  throw robot::RobotError(problem);
}

struct Strain {
  int joint = -1;
  double share = HUGE_VAL;  // of its torque limit; infinite where no posture is in reach
};

/// The leg's joint that bears most of its limit on one foot.
Strain StrainOnOneFoot(const RobotModel& model, const Anatomy& anatomy, const FoundStance& stance) {
  const std::optional<Eigen::VectorXd> torque = OneFootTorque(model, stance.state);
  if (!torque) return {};
  Strain strain{-1, 0};
  for (const Leg& leg : anatomy.leg) {
    for (const int j : leg.joints) {
      const double share = (*torque)[j] / robot::PeakTorque(model, static_cast<size_t>(j));
      if (share > strain.share) strain = {j, share};
    }
  }
  return strain;
}

}  // namespace

Eigen::VectorXd WithinLimits(const RobotModel& model, Eigen::VectorXd wanted) {
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    if (!std::isfinite(joint.lower) || !std::isfinite(joint.upper)) continue;
    const double margin = std::min(kMostMargin, kLimitShare * (joint.upper - joint.lower));
    wanted[j] = std::clamp(wanted[j], joint.lower + margin, joint.upper - margin);
  }
  return wanted;
}

FoundStance FindStance(const RobotModel& model, const Anatomy& anatomy,
                       const Eigen::VectorXd& nominal, bool bend_knees) {
  const robot::RobotData zero = robot::Evaluate(model, nominal);
  const double spacing = Rounded(std::abs(zero.foot_pose[robot::Foot::kLeft].translation().y() -
                                          zero.foot_pose[robot::Foot::kRight].translation().y()));
  const FoundStance widest = StanceAt(model, anatomy, nominal, bend_knees, spacing);
  const Strain strain = StrainOnOneFoot(model, anatomy, widest);
  if (strain.share <= kComfort) return widest;
  const double soles = 0.5 * (model.feet()[0].width + model.feet()[1].width) + kLeastGap;
  std::optional<FoundStance> bearable;
  for (int i = 1; i <= kNarrowings; ++i) {
    const double share = 1 - i * kNarrowing;
    if (share * spacing < soles) break;
    FoundStance narrower;
    try {
      narrower = StanceAt(model, anatomy, nominal, bend_knees, Rounded(share * spacing));
    } catch (const robot::RobotError&) {
      break;
    }
    const double borne = StrainOnOneFoot(model, anatomy, narrower).share;
    if (borne > kComfort && (borne > 1 || strain.share <= 1 || bearable)) continue;
    bearable = narrower;
    if (borne <= kComfort) break;
  }
  if (!bearable) return widest;
  bearable->wider_spacing = spacing;
  bearable->strained = strain.joint;
  bearable->strain = strain.share;
  return *bearable;
}

}  // namespace poise
