#include "components/step_planner/stepping/swing.h"

#include <algorithm>

namespace poise::stepping {
namespace {

// Share of the time in which the sole rises: the toes clear what lies ahead early, and the sole
// comes down late, upright.
constexpr double kRise = 0.4;
// s: a move is never planned shorter.
constexpr double kLeastTime = 0.01;

}  // namespace

void Quintic::Begin(const Point& from, const Point& to, double start, double duration) {
  const double t = duration, v0 = from.velocity * t, v1 = to.velocity * t;
  const double a0 = from.acceleration * t * t, a1 = to.acceleration * t * t;
  const double d = to.position - from.position;
  coefficient_ = {from.position,
                  v0,
                  0.5 * a0,
                  10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
                  -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
                  6 * d - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1};
  start_ = start;
  duration_ = duration;
}

Quintic::Point Quintic::At(double time) const {
  const auto& c = coefficient_;
  const double late = std::max(0.0, time - start_ - duration_);
  const double s = std::clamp((time - start_) / duration_, 0.0, 1.0);
  Point point;
  point.velocity =
      (c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5])))) / duration_;
  point.position =
      c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5])))) + late * point.velocity;
  if (late > 0) return point;
  point.acceleration =
      (2 * c[2] + s * (6 * c[3] + s * (12 * c[4] + s * 20 * c[5]))) / (duration_ * duration_);
  return point;
}

void Swing::Begin(const PointMotion& from, const Eigen::Matrix3d& rotation,
                  const Eigen::Vector3d& foothold, const Eigen::Matrix3d& level, double time,
                  double end, const SwingSpec& spec) {
  spec_ = spec;
  foothold_ = foothold;
  start_ = time;
  end_ = std::max(end, time + kLeastTime);
  apex_ = start_ + kRise * (end_ - start_);
  const auto point = [&](int i) {
    return Quintic::Point{from.position[i], from.velocity[i], from.acceleration[i]};
  };
  const double wait = spec.wait * (end_ - start_);
  const double duration = (spec.across < 1 ? Across(start_) : end_ - start_) - wait;
  x_.Begin(point(0), {foothold.x()}, start_ + wait, duration);
  y_.Begin(point(1), {foothold.y()}, start_ + wait, duration);
  apex_height_ = std::max(foothold.z() + spec.clearance, from.position.z() + spec.rise);
  rise_.Begin(point(2), {apex_height_}, start_, apex_ - start_);
  fall_.Begin({apex_height_}, {foothold.z(), -spec.touch_speed}, apex_, end_ - apex_);
  from_rotation_ = rotation;
  const Eigen::AngleAxisd turn(level * rotation.transpose());
  turn_ = turn.angle() * turn.axis();
}

void Swing::Move(const Eigen::Vector2d& foothold, double time, double end) {
  if (frozen(time)) return;
  end = std::max(end, time + std::max(spec_.freeze, kLeastTime));
  const Quintic::Point x = x_.At(time), y = y_.At(time);
  foothold_.head<2>() = foothold;
  const double duration = spec_.across < 1 ? Across(time) : end - time;
  x_.Begin(x, {foothold.x()}, time, duration);
  y_.Begin(y, {foothold.y()}, time, duration);
  if (end == end_) return;
  if (time < apex_) {
    const Quintic::Point z = rise_.At(time);
    apex_ = std::max(time + kLeastTime, start_ + kRise * (end - start_));
    rise_.Begin(z, {apex_height_}, time, apex_ - time);
    fall_.Begin({apex_height_}, {foothold_.z(), -spec_.touch_speed}, apex_, end - apex_);
  } else {
    fall_.Begin(fall_.At(time), {foothold_.z(), -spec_.touch_speed}, time, end - time);
  }
  end_ = end;
}

double Swing::Across(double time) const {
  return std::max(start_ + spec_.across * (end_ - start_) - time,
                  std::max(spec_.freeze, kLeastTime));
}

double Swing::Progress(double time) const {
  return std::clamp((time - start_) / (end_ - start_), 0.0, 1.0);
}

PointMotion Swing::At(double time) const {
  const Quintic::Point x = x_.At(time), y = y_.At(time);
  const Quintic::Point z = time < apex_ ? rise_.At(time) : fall_.At(time);
  return {{x.position, y.position, z.position},
          {x.velocity, y.velocity, z.velocity},
          {x.acceleration, y.acceleration, z.acceleration}};
}

RotationMotion Swing::RotationAt(double time) const {
  // About one axis by minimum jerk: level in two thirds of the way.
  const double duration = 2.0 / 3 * (end_ - start_);
  const double s = std::clamp((time - start_) / duration, 0.0, 1.0);
  const double share = s * s * s * (10 + s * (-15 + 6 * s));
  const double rate = 30 * s * s * (1 - s) * (1 - s) / duration;
  const double rise = 60 * s * (1 - s) * (1 - 2 * s) / (duration * duration);
  const double angle = turn_.norm();
  RotationMotion motion;
  motion.rotation = from_rotation_;
  if (angle > 0) {
    motion.rotation = Eigen::AngleAxisd(share * angle, turn_ / angle) * from_rotation_;
  }
  motion.angular_velocity = rate * turn_;
  motion.angular_acceleration = rise * turn_;
  return motion;
}

void Swing::Archive(StateArchive* archive) {
  archive->Show(spec_);
  x_.Archive(archive);
  y_.Archive(archive);
  rise_.Archive(archive);
  fall_.Archive(archive);
  archive->Show(foothold_, start_, apex_, end_, apex_height_, from_rotation_, turn_);
}

}  // namespace poise::stepping
