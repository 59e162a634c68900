#include "components/step_planner/stepping/step_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "components/step_planner/legs/swing.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

// Greatest acceleration of a minimum-jerk line of unit length and time.
constexpr double kQuinticAcceleration = 5.7735026918962577;
constexpr int kRounds = 4;  // of the step's time and foothold, each of which follows from the other
constexpr double kFixedPoint = 2e-3;  // s, a tick: the step's time is found to that
constexpr double kLater = 0.06;       // s, after which a place out of reach is tried again
// m of margin for which a step may take a second longer.
constexpr double kMarginOfTime = 0.05;
// m by which a swing may cut the corner of the stance leg's room: feet that stand are off by that.
constexpr double kCut = 0.005;
// Share of the acceleration that a swing around the stance leg has, which has to keep to its way.
// With all of it a foot of the paper's robot came down 40 mm short and close to the other one.
constexpr double kAroundShare = 0.7;
constexpr double kOffReach = 1e-9;  // m off a polygon that is rounding
// ωT of a step at most: what the capture point is off by has grown 55 times then, beyond any reach.
constexpr double kLongest = 4;
// m by which a step that does not catch the capture point must still come nearer than standing.
constexpr double kLeastGain = 0.02;
constexpr int kStepsAhead = 2;        // after the one that is chosen
constexpr double kCostOfStep = 0.01;  // m of margin that a step must be worth
// m that a stride's foothold may be off before the foot comes down sooner, by so many s at a time.
constexpr double kMissed = 0.01, kSooner = 0.02;
constexpr int kWayHalvings = 5;  // of a foothold's way back to where the legs are clear

/// The segment keeps out of |x| < half.x, y < half.y, where the stance leg is, and beyond it, where
/// the swing leg does not get around it.
bool IsFree(const Vector2d& from, const Vector2d& to, const Vector2d& half) {
  // The part of the segment with y < half.y, then where that is in x.
  double begin = 0, end = 1;
  const double down = from.y() - to.y(), over = from.y() - half.y();
  if (from.y() >= half.y() && to.y() >= half.y()) return true;
  if (from.y() >= half.y()) begin = over / down;
  if (to.y() >= half.y()) end = over / down;
  const double one = from.x() + begin * (to.x() - from.x());
  const double other = from.x() + end * (to.x() - from.x());
  return std::min(one, other) >= half.x() || std::max(one, other) <= -half.x();
}

}  // namespace

void StepPlan::Archive(StateArchive* archive) {
  archive->Show(possible, foot, time, foothold, yaw, cop, capture_point, com, margin, leg_margin,
                missed, moved, crossing, around, corner);
}

double LeastSwingTime(double distance, double acceleration) {
  return std::sqrt(kQuinticAcceleration * distance / acceleration);
}

Vector2d StepChoice::BrakingCop(const StepState& state, Foot stance) const {
  return balance::NearestPoint(Sole(state, stance), state.pendulum.capture_point());
}

balance::ConvexPolygon StepChoice::Soles(const StepState& state, double margin) const {
  balance::ConvexPolygon soles;
  for (const Foot i : kFeet) {
    if (!state.in_contact[i]) continue;
    soles = HullOf(soles, SoleAt(feet_[i], margin, state.sole[i], state.sole_yaw[i]));
  }
  return soles;
}

double StepChoice::DistanceOfLegs(Foot foot, const Vector2d& foothold, const Vector2d& com) const {
  const double height = legs_.height() - reach_.lowering();
  const auto from_com = [&](const Vector2d& sole) -> Eigen::Vector3d {
    return {sole.x() - com.x(), sole.y() - com.y(), -height};
  };
  return LegDistance(legs_.At(foot, from_com(foothold)),
                     legs_.At(Other(foot), from_com(Vector2d::Zero())));
}

bool StepChoice::ClearOfLeg(Foot foot, const Vector2d& com, Vector2d* foothold) const {
  const auto clear = [&](const Vector2d& at) {
    return DistanceOfLegs(foot, at, com) >= limits_.leg_distance;
  };
  if (clear(*foothold)) return true;
  const double side = Side(foot);
  Vector2d in = {foothold->x(), side * reach_.least_spacing()}, out = *foothold;
  if (!clear(in)) return false;
  for (int i = 0; i < kWayHalvings; ++i) {
    const Vector2d middle = 0.5 * (in + out);
    (clear(middle) ? in : out) = middle;
  }
  *foothold = in;
  return true;
}

bool StepChoice::WayAround(double side, const Vector2d& from, const Vector2d& to,
                           StepPlan* plan) const {
  // As if the swing foot were the left one.
  const Vector2d start(from.x(), side * from.y()), goal(to.x(), side * to.y());
  const Vector2d corner(reach_.least_ahead(), reach_.least_spacing());
  Vector2d half = corner - Vector2d::Constant(kCut);
  // A foot that stands nearer than that goes from where it is.
  if (std::abs(start.x()) < half.x()) half.y() = std::min(half.y(), start.y());
  plan->around = false;
  if (IsFree(start, goal, half)) return true;
  const double ahead = std::abs(start.x()) > std::abs(goal.x()) ? start.x() : goal.x();
  for (const double sign : {ahead < 0 ? -1.0 : 1.0, ahead < 0 ? 1.0 : -1.0}) {
    const Vector2d by(sign * corner.x(), corner.y());
    if (!IsFree(start, by, half) || !IsFree(by, goal, half)) continue;
    plan->around = true;
    plan->corner = {by.x(), side * by.y()};
    return true;
  }
  return false;
}

StepPlan StepChoice::Until(const StepState& state, Foot foot, double time,
                           const Vector2d& cop) const {
  StepPlan plan;
  plan.possible = true;
  plan.foot = foot;
  plan.time = time;
  plan.yaw = state.yaw;
  plan.cop = cop;
  plan.capture_point =
      CapturePointAfter(state.pendulum.capture_point(), cop, state.pendulum.frequency, time);
  plan.com = After(state.pendulum, cop, time).com;
  return plan;
}

StepPlan StepChoice::At(const StepState& state, Foot foot, double time, Crossing crossing) const {
  const Foot s = Other(foot);
  StepPlan plan = Until(state, foot, time, BrakingCop(state, s));
  plan.crossing = crossing;
  // From here on in axes of the heading, from the stance sole.
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(state.yaw).toRotationMatrix();
  const auto local = [&](const Vector2d& point) -> Vector2d {
    return turn.transpose() * (point - state.sole[s]);
  };
  const Vector2d caught = local(plan.capture_point), cop = local(plan.cop);
  const Vector2d away = caught - cop;
  const double distance = away.norm();
  Vector2d wanted = caught;
  if (distance > 0) wanted += limits_.overshoot / distance * away;
  const double side = Side(foot);
  if (crossing == Crossing::kNone) {
    // Side by side as when standing, and nearer where the capture point is on the stance foot's
    // side.
    const double narrow =
        std::max(side * caught.y() + 0.5 * limits_.spacing, reach_.least_spacing());
    wanted.y() = side * std::max(side * wanted.y(), std::min(limits_.spacing, narrow));
  } else {
    // As far on its own side as holds the capture point well.
    const double room =
        std::max(0.0, 0.5 * feet_[foot].width - limits_.sole_margin - limits_.ample_margin);
    wanted.y() = std::clamp(side * limits_.spacing, wanted.y() - room, wanted.y() + room);
  }
  PutDown(state, wanted, CountedLowering(crossing), &plan);
  return plan;
}

void StepChoice::PutDown(const StepState& state, const Vector2d& wanted, double share,
                         StepPlan* plan) const {
  const Foot foot = plan->foot, stance = Other(foot);
  const Foot s = stance;
  const Crossing crossing = plan->crossing;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(state.yaw).toRotationMatrix();
  const auto local = [&](const Vector2d& point) -> Vector2d {
    return turn.transpose() * (point - state.sole[s]);
  };
  const Vector2d com = local(plan->com);
  plan->leg_margin = balance::SignedDistance(reach_.Leg(stance, share), Vector2d(-com));
  const balance::ConvexPolygon footholds = reach_.Footholds(foot, com, crossing, share);
  Vector2d foothold(0, Side(foot) * limits_.spacing);
  bool reached = footholds.num_corners > 0;
  if (reached) foothold = balance::NearestPoint(footholds, wanted);
  if (crossing != Crossing::kNone && reached) {
    reached = ClearOfLeg(foot, reach_.ComAbove(stance, com, share), &foothold) &&
              balance::SignedDistance(footholds, foothold) >= -kOffReach;
  }
  if (limits_.leg_distance > 0) {
    reached = WayAround(Side(foot), local(state.sole[foot]), foothold, plan) && reached;
    plan->corner = state.sole[s] + turn * plan->corner;
  }
  plan->missed = (foothold - wanted).norm();
  plan->foothold = state.sole[s] + turn * foothold;
  const balance::ConvexPolygon soles =
      HullOf(Sole(state, s), SoleAt(feet_[foot], limits_.sole_margin, plan->foothold, plan->yaw));
  plan->margin = balance::SignedDistance(soles, plan->capture_point);
  // A COM that the stance leg cannot follow is as bad as a capture point outside.
  plan->margin = std::min(plan->margin, plan->margin + plan->leg_margin);
  if (!reached) plan->margin = -std::numeric_limits<double>::infinity();
}

FootstepLimits StepChoice::StrideLimits() const {
  return {limits_.spacing, reach_.least_spacing(), limits_.longest, limits_.widest,
          limits_.most_turn};
}

Vector2d StepChoice::CapturePointAtLiftOff(const StepState& state, Foot stance,
                                           const Gait& gait) const {
  const auto stride =
      NominalStride({state.sole[stance], state.sole_yaw[stance]}, Other(stance), gait.command,
                    gait.period, state.pendulum.frequency, StrideLimits());
  return state.sole[stance] + stride.begin;
}

CaptureReference StepChoice::StrideReference(const StepState& state, Foot stance, const Gait& gait,
                                             double left) const {
  const double w = state.pendulum.frequency;
  const Vector2d& sole = state.sole[stance];
  const auto stride = NominalStride({sole, state.sole_yaw[stance]}, Other(stance), gait.command,
                                    gait.period, w, StrideLimits());
  const Vector2d from_sole =
      std::exp(-w * std::max(left, 0.0)) * (stride.next.position - sole + stride.end);
  return {sole + from_sole, w * from_sole};
}

StepPlan StepChoice::StrideAt(const StepState& state, Foot foot, const Gait& gait,
                              double time) const {
  const Foot s = Other(foot);
  const auto stride = NominalStride({state.sole[s], state.sole_yaw[s]}, foot, gait.command,
                                    gait.period, state.pendulum.frequency, StrideLimits());
  const balance::ConvexPolygon sole = Sole(state, s);
  const double carries = time + gait.transfer;
  const Vector2d cop =
      LeadingCop(state.pendulum, StrideReference(state, s, gait, carries), gait.gain, sole);
  StepPlan plan = Until(state, foot, carries, cop);
  plan.time = time;
  plan.yaw = stride.next.yaw;
  const Vector2d wanted = plan.capture_point - stride.end - state.sole[s];
  PutDown(state, Eigen::Rotation2Dd(-state.yaw) * wanted, 1, &plan);
  plan.moved = (plan.foothold - stride.next.position).norm();
  return plan;
}

StepPlan StepChoice::Stride(const StepState& state, Foot foot, const Gait& gait,
                            double unload) const {
  const auto least = [&](const StepPlan& plan) {
    return unload +
           std::max(limits_.least_swing, LeastSwingTime((plan.foothold - state.sole[foot]).norm(),
                                                        limits_.acceleration));
  };
  double time = unload + gait.period - gait.transfer;
  StepPlan plan = StrideAt(state, foot, gait, time);
  if (const double needed = least(plan); needed > time) {
    return StrideAt(state, foot, gait, needed);
  }
  while (plan.missed > kMissed && time - kSooner >= least(plan)) {
    time -= kSooner;
    const StepPlan sooner = StrideAt(state, foot, gait, time);
    if (!(sooner.missed < plan.missed)) break;
    plan = sooner;
  }
  return plan;
}

StepPlan StepChoice::Plan(const StepState& state, Foot foot, double unload,
                          Crossing crossing) const {
  double time = unload + limits_.least_swing;
  StepPlan plan;
  for (int i = 0; i < kRounds; ++i) {
    plan = At(state, foot, time, crossing);
    const Vector2d& from = state.sole[foot];
    const double swing = plan.around
                             ? std::sqrt(CornerAcceleration(from, plan.corner, plan.foothold) /
                                         (kAroundShare * limits_.acceleration))
                             : LeastSwingTime((plan.foothold - from).norm(), limits_.acceleration);
    double needed = unload + std::max(limits_.least_swing, swing);
    // Later the COM is nearer to where the foot has to go.
    if (!std::isfinite(plan.margin)) needed = time + kLater;
    if (needed <= time + kFixedPoint) break;
    time = needed;
    if (state.pendulum.frequency * time > kLongest) {
      plan.margin = -std::numeric_limits<double>::infinity();
      break;
    }
  }
  return plan;
}

StepPlan StepChoice::Beside(const StepState& state, Foot foot, double time) const {
  const Foot s = Other(foot);
  const double side = Side(foot);
  StepPlan plan;
  plan.possible = true;
  plan.foot = foot;
  plan.time = time;
  plan.yaw = state.sole_yaw[s];
  plan.cop = plan.capture_point = plan.com = state.sole[s];
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(plan.yaw).toRotationMatrix();
  const Vector2d foothold(0, side * limits_.spacing);
  plan.foothold = state.sole[s] + turn * foothold;
  const Vector2d from = turn.transpose() * (state.sole[foot] - state.sole[s]);
  const bool reached = WayAround(side, from, foothold, &plan);
  plan.corner = state.sole[s] + turn * plan.corner;
  plan.margin = reached ? limits_.ample_margin : -std::numeric_limits<double>::infinity();
  return plan;
}

bool StepChoice::Helps(const StepState& state, const StepPlan& plan) const {
  if (plan.margin >= 0) return true;
  // The stance sole would leave the ground before the foot comes down.
  if (plan.leg_margin < 0) return false;
  const balance::ConvexPolygon soles = Soles(state);
  const Vector2d now = state.pendulum.capture_point();
  const Vector2d stays = CapturePointAfter(now, balance::NearestPoint(soles, now),
                                           state.pendulum.frequency, plan.time);
  return plan.margin > balance::SignedDistance(soles, stays) + kLeastGain;
}

double StepChoice::CostAfter(const StepState& state, const StepPlan& plan, int more) const {
  const double outside =
      std::max(0.0, limits_.ample_margin - plan.margin) + std::max(0.0, -plan.leg_margin);
  double cost = outside;
  if (more == 0 || outside == 0) return cost;
  StepState next = state;
  next.pendulum = After(state.pendulum, plan.cop, plan.time);
  next.sole[plan.foot] = plan.foothold;
  next.sole_yaw[plan.foot] = plan.yaw;
  next.in_contact = {true, true};
  Best(next, Other(plan.foot), limits_.unload, more - 1, &cost);
  return cost;
}

StepPlan StepChoice::Best(const StepState& state, Foot foot, double unload, int more,
                          double* least) const {
  StepPlan best;
  const auto consider = [&](const StepPlan& plan) {
    if (!std::isfinite(plan.margin)) return;
    const double cost = CostAfter(state, plan, more) + kCostOfStep + kMarginOfTime * plan.time;
    if (cost >= *least) return;
    best = plan;
    *least = cost;
  };
  const StepPlan beside = Plan(state, foot, unload);
  consider(beside);
  if (!(limits_.leg_distance > 0) || beside.margin >= limits_.ample_margin) return best;
  const Vector2d away = state.pendulum.capture_point() - state.sole[Other(foot)];
  const double ahead = std::cos(state.yaw) * away.x() + std::sin(state.yaw) * away.y();
  consider(Plan(state, foot, unload, ahead < 0 ? Crossing::kBehind : Crossing::kInFront));
  return best;
}

StepPlan StepChoice::Choose(const StepState& state) const {
  StepPlan best;
  double least = std::numeric_limits<double>::infinity();
  for (const Foot foot : kFeet) {
    // The stance foot must be there to stand on.
    if (!state.in_contact[Other(foot)]) continue;
    const double unload = state.in_contact[foot] ? limits_.unload : 0;
    const StepPlan plan = Best(state, foot, unload, kStepsAhead, &least);
    if (plan.possible) best = plan;
  }
  return best;
}

StepPlan StepChoice::Next(const StepState& state, Foot foot, double unload) const {
  double least = std::numeric_limits<double>::infinity();
  return Best(state, foot, unload, kStepsAhead, &least);
}

}  // namespace poise::stepping
