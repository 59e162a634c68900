#include "components/step_planner/stepping/swing.h"

#include <algorithm>
#include <cmath>

#include "components/balance/minimum_jerk.h"

namespace poise::stepping {
namespace {

// Share of the time in which the sole rises: the toes clear what lies ahead early, and the sole
// comes down late, upright.
constexpr double kRise = 0.4;
// s: a move is never planned shorter.
constexpr double kLeastTime = 0.01;
// Fitted to ways around a sole of 0.3 x 0.15 m: some 10 % above the least acceleration of all times
// and velocities at the corner, and nowhere inside it.
constexpr double kCornerSpeed = 1.5;  // of the mean speed along both pieces
constexpr double kCornerPower = 0.6;  // of the pieces' lengths, as which their times go
constexpr int kSamples = 8;           // of a piece's acceleration
constexpr double kLeastPiece = 1e-3;  // m

}  // namespace

Passing PassCorner(const Eigen::Vector2d& from, const Eigen::Vector2d& corner,
                   const Eigen::Vector2d& to) {
  const Eigen::Vector2d first = corner - from, second = to - corner;
  const double before = std::max(first.norm(), kLeastPiece);
  const double after = std::max(second.norm(), kLeastPiece);
  const double weight = std::pow(before, kCornerPower);
  return {weight / (weight + std::pow(after, kCornerPower)),
          0.5 * kCornerSpeed * (before + after) * (first / before + second / after)};
}

double CornerAcceleration(const Eigen::Vector2d& from, const Eigen::Vector2d& corner,
                          const Eigen::Vector2d& to) {
  const Passing passing = PassCorner(from, corner, to);
  double largest = 0;
  for (const bool after : {false, true}) {
    std::array<Quintic, 2> way;
    const double duration = after ? 1 - passing.share : passing.share;
    for (int i = 0; i < 2; ++i) {
      const Quintic::Point turn{corner[i], passing.velocity[i]};
      way[static_cast<size_t>(i)].Begin(after ? turn : Quintic::Point{from[i]},
                                        after ? Quintic::Point{to[i]} : turn, 0, duration);
    }
    for (int k = 0; k <= kSamples; ++k) {
      const double time = duration * k / kSamples;
      largest =
          std::max(largest, std::hypot(way[0].At(time).acceleration, way[1].At(time).acceleration));
    }
  }
  return largest;
}

void Swing::Begin(const PointMotion& from, const Eigen::Matrix3d& rotation,
                  const Eigen::Vector3d& foothold, const Eigen::Matrix3d& level, double time,
                  double end, const SwingSpec& spec) {
  spec_ = spec;
  foothold_ = foothold;
  around_ = false;
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

void Swing::GoAround(const Eigen::Vector2d& corner) {
  around_ = true;
  corner_ = corner;
  const Quintic::Point x = x_.At(start_), y = y_.At(start_);
  from_ = {x.position, y.position};
  corner_time_ = end_;
  Turn(x, y, start_);
}

void Swing::Turn(const Quintic::Point& x, const Quintic::Point& y, double time) {
  const Passing passing = PassCorner(from_, corner_, foothold_.head<2>());
  const double whole = end_ - start_;
  const std::array<Quintic::Point, 2> turn{
      Quintic::Point{corner_.x(), passing.velocity.x() / whole},
      Quintic::Point{corner_.y(), passing.velocity.y() / whole}};
  // The first bound, should rounding leave the second below it.
  corner_time_ = std::max(
      time + kLeastTime,
      std::min(start_ + passing.share * whole, std::max(end_, time + 2 * kLeastTime) - kLeastTime));
  x_.Begin(x, turn[0], time, corner_time_ - time);
  y_.Begin(y, turn[1], time, corner_time_ - time);
  const double left = std::max(end_ - corner_time_, kLeastTime);
  after_x_.Begin(turn[0], {foothold_.x()}, corner_time_, left);
  after_y_.Begin(turn[1], {foothold_.y()}, corner_time_, left);
}

void Swing::Move(const Eigen::Vector2d& foothold, double time, double end) {
  if (frozen(time)) return;
  end = std::max(end, time + std::max(spec_.freeze, kLeastTime));
  // So near to the corner the pieces stay; a tick or some later the last one moves.
  if (around_ && time < corner_time_ && time > corner_time_ - 2 * kLeastTime) return;
  const bool before = around_ && time < corner_time_;
  const bool after = around_ && !before;
  const Quintic::Point x = (after ? after_x_ : x_).At(time), y = (after ? after_y_ : y_).At(time);
  foothold_.head<2>() = foothold;
  // It goes on rising straight up for as long as it was to.
  const double from = std::max(time, start_ + spec_.wait * (end_ - start_));
  double duration = (spec_.across < 1 ? Across(time) : end - time) - (from - time);
  if (from > time) duration = std::max(duration, kLeastTime);
  if (!before) {
    (after ? after_x_ : x_).Begin(x, {foothold.x()}, from, duration);
    (after ? after_y_ : y_).Begin(y, {foothold.y()}, from, duration);
  }
  MoveEnd(time, end);
  if (before) Turn(x, y, time);
}

void Swing::MoveEnd(double time, double end) {
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
  const bool after = around_ && time >= corner_time_;
  const Quintic::Point x = (after ? after_x_ : x_).At(time), y = (after ? after_y_ : y_).At(time);
  const Quintic::Point z = time < apex_ ? rise_.At(time) : fall_.At(time);
  return {{x.position, y.position, z.position},
          {x.velocity, y.velocity, z.velocity},
          {x.acceleration, y.acceleration, z.acceleration}};
}

RotationMotion Swing::RotationAt(double time) const {
  // About one axis by minimum jerk: level in two thirds of the way.
  const balance::MinimumJerk turned(time - start_, 2.0 / 3 * (end_ - start_));
  const double angle = turn_.norm();
  RotationMotion motion;
  motion.rotation = from_rotation_;
  if (angle > 0) {
    motion.rotation = Eigen::AngleAxisd(turned.position * angle, turn_ / angle) * from_rotation_;
  }
  motion.angular_velocity = turned.speed * turn_;
  motion.angular_acceleration = turned.acceleration * turn_;
  return motion;
}

void Swing::Archive(StateArchive* archive) {
  archive->Show(spec_);
  archive->Show(x_, y_, rise_, fall_, after_x_, after_y_, around_, from_, corner_, corner_time_);
  archive->Show(foothold_, start_, apex_, end_, apex_height_, from_rotation_, turn_);
}

}  // namespace poise::stepping
