#include "components/step_planner/reference_generator.h"

#include <algorithm>
#include <cmath>

#include "components/framework/tick_time.h"
#include "components/step_planner/phase_graph.h"

namespace poise {

using robot::Foot;
using robot::kFeet;

void ReferencePoint::Hold(const Eigen::Vector3d& position) {
  move_.Hold(position);
  pending_ = false;
  target_ = position;
  start_ = duration_ = 0;
}

void ReferencePoint::Schedule(const Eigen::Vector3d& target, double start, double duration) {
  target_ = target;
  start_ = start;
  duration_ = duration;
  pending_ = true;
}

void ReferencePoint::Lead(const PointMotion& from, const Eigen::Vector3d& target, double start,
                          double duration) {
  move_.Begin(from, target, start, duration);
  pending_ = false;
  target_ = target;
  start_ = start;
  duration_ = duration;
}

PointMotion ReferencePoint::At(double time) {
  if (pending_ && time >= start_) {
    move_.Begin(move_.At(start_), target_, start_, duration_);
    pending_ = false;
  }
  return move_.At(time);
}

PointMotion ReferencePoint::Slow(double time, double period, double rate) {
  PointMotion motion = At(time);
  if (rate >= 1 || !move_.UnderWay(time)) return motion;
  const double delay = (1 - rate) * period;
  move_.Postpone(delay);
  if (!pending_) start_ += delay;
  motion = move_.At(time);
  motion.velocity *= rate;
  motion.acceleration *= rate * rate;
  return motion;
}

void ReferencePoint::Archive(StateArchive* archive) {
  archive->Show(move_, pending_, target_, start_, duration_);
}

void ReferenceTurn::Hold(const Eigen::Matrix3d& rotation) {
  origin_ = rotation;
  vector_.Hold(Eigen::Vector3d::Zero());
}

void ReferenceTurn::Schedule(const Eigen::Vector3d& target, double start, double duration) {
  vector_.Schedule(target, start, duration);
}

RotationMotion ReferenceTurn::At(double time) {
  const PointMotion motion = vector_.At(time);
  const Eigen::Vector3d &r = motion.position, &v = motion.velocity;
  const double angle = r.norm();
  if (angle == 0 && v.isZero(0) && motion.acceleration.isZero(0)) return {.rotation = origin_};
  // ω = J v with J = I + a [r]× + b [r]×², a = (1 − cos θ)/θ², b = (θ − sin θ)/θ³; below 1e-3 rad
  // the first terms of their series, whose rest is below rounding. Slopes: by θ, over θ.
  const double square = angle * angle;
  double a = 0.5 - square / 24, b = 1.0 / 6 - square / 120;
  double a_slope = -1.0 / 12 + square / 180, b_slope = -1.0 / 60 + square / 1260;
  if (angle > 1e-3) {
    const double sine = std::sin(angle), cosine = std::cos(angle);
    a = (1 - cosine) / square;
    b = (angle - sine) / (square * angle);
    a_slope = (sine / angle - 2 * a) / square;
    b_slope = ((1 - cosine) / square - 3 * b) / square;
  }
  const double rate = r.dot(v);  // θ θ'
  const Eigen::Vector3d across = r.cross(v), twice = r.cross(across);
  RotationMotion turn;
  turn.rotation = angle > 0 ? Eigen::AngleAxisd(angle, r / angle) * origin_ : origin_;
  turn.angular_velocity = v + a * across + b * twice;
  // J' v + J v', where [r]× v' is the derivative of [r]× v as [v]× v vanishes.
  const Eigen::Vector3d across_rate = r.cross(motion.acceleration);
  turn.angular_acceleration = motion.acceleration + a_slope * rate * across + a * across_rate +
                              b_slope * rate * twice + b * (v.cross(across) + r.cross(across_rate));
  return turn;
}

void ReferenceTurn::Archive(StateArchive* archive) { archive->Show(origin_, vector_); }

void References::Archive(StateArchive* archive) { archive->Show(com, body, foot, foot_rotation); }

void ReferenceGenerator::Archive(StateArchive* archive) {
  archive->Show(time_, anchored_, shifts_, foot_free_, com_, foot_, body_turn_, foot_turn_,
                references_);
}

Eigen::Vector3d ReferenceGenerator::ComTarget(const ComReference& com,
                                              const EstimatedPose& estimate,
                                              const Eigen::Vector3d& standing) const {
  const Eigen::Vector3d right = estimate.sole[Foot::kRight].translation();
  const Eigen::Vector3d left = estimate.sole[Foot::kLeft].translation();
  Eigen::Vector3d target = standing;
  switch (com.target()) {
    case ComReference::HOLD:
      return standing;
    case ComReference::OVER_RIGHT:
      target.head<2>() = right.head<2>();
      break;
    case ComReference::OVER_LEFT:
      target.head<2>() = left.head<2>();
      break;
    case ComReference::OVER_MIDDLE:
      target.head<2>() = 0.5 * (right + left).head<2>();
      break;
    case ComReference::SHIFT:
      break;
  }
  return target + Eigen::Vector3d(com.x(), com.y(), com.z());
}

void ReferenceGenerator::BeginPhase(const Phase& phase, const EstimatedPose& estimate,
                                    double time) {
  if (!anchored_) {
    com_.Hold(estimate.com);
    shifts_ = false;
    body_turn_.Hold(estimate.body_rotation);
    foot_free_ = {false, false};
    anchored_ = true;
  }
  if (phase.gravity_compensation()) {
    anchored_ = false;  // the posture is free from here on
    return;
  }
  if (phase.has_com()) {
    const ComReference& com = phase.com();
    const Eigen::Vector3d standing = com_.At(time).position;
    com_.Schedule(ComTarget(com, estimate, shifts_ ? com_.target() : standing), time + com.delay(),
                  com.duration());
    shifts_ = false;
  }
  const auto schedule = [time](const Turn& turn, ReferenceTurn* reference) {
    reference->Schedule({turn.x(), turn.y(), turn.z()}, time + turn.delay(), turn.duration());
  };
  if (phase.has_body()) schedule(phase.body(), &body_turn_);
  const robot::FootArray<bool> in_contact = ContactsOf(phase.support());
  for (const Foot f : kFeet) {
    if (!in_contact[f] && !foot_free_[f]) {
      foot_[f].Hold(estimate.sole[f].translation());
      foot_turn_[f].Hold(estimate.sole[f].linear());
    }
    foot_free_[f] = !in_contact[f];
  }
  if (phase.has_foot()) {
    const FootReference& foot = phase.foot();
    const Foot swing = robot::FootAt(foot.foot());
    Eigen::Vector3d target =
        foot_[swing].At(time).position + Eigen::Vector3d(foot.x(), foot.y(), foot.z());
    if (foot.has_height_above_support()) {
      target.z() = estimate.sole[Other(swing)].translation().z() + foot.height_above_support();
    }
    foot_[swing].Schedule(target, time + foot.delay(), foot.duration());
    if (foot.has_turn()) schedule(foot.turn(), &foot_turn_[swing]);
  }
}

const References& ReferenceGenerator::Update(double time, const Eigen::Vector3d& com) {
  const PointMotion on_time = com_.At(time);
  const double speed = on_time.velocity.norm();
  const double lag = speed > 0 ? (on_time.position - com).dot(on_time.velocity) / speed : 0;
  const double rate = std::clamp(2 * (1 - lag / kComLag), 0.0, 1.0);
  references_.com = com_.Slow(time, TickPeriod(time - time_), rate);
  time_ = time;
  for (const Foot f : kFeet) {
    if (!foot_free_[f]) continue;
    references_.foot[f] = foot_[f].At(time);
    references_.foot_rotation[f] = foot_turn_[f].At(time);
  }
  references_.body = body_turn_.At(time);
  return references_;
}

void ReferenceGenerator::Anchor(const EstimatedPose& estimate, const PointMotion& com,
                                const Eigen::Vector3d& com_target, double time, double duration) {
  com_.Lead(com, com_target, time, duration);
  shifts_ = false;
  for (const Foot f : kFeet) {
    HoldFoot(f, estimate.sole[f].translation(), estimate.sole[f].linear());
  }
}

void ReferenceGenerator::HoldFoot(Foot foot, const Eigen::Vector3d& position,
                                  const Eigen::Matrix3d& rotation) {
  foot_[foot].Hold(position);
  foot_turn_[foot].Hold(rotation);
}

}  // namespace poise
