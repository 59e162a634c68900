#include "components/step_planner/legs/swing.h"

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

void Begin(const Horizontal& from, const Horizontal& to, double start, double duration,
           std::array<Quintic, 2>* way) {
  for (size_t i = 0; i < way->size(); ++i) (*way)[i].Begin(from[i], to[i], start, duration);
}

Horizontal At(const std::array<Quintic, 2>& way, double time) {
  return {way[0].At(time), way[1].At(time)};
}

Horizontal AtCorner(const Eigen::Vector2d& corner, const Eigen::Vector2d& velocity) {
  return {Quintic::Point{corner.x(), velocity.x()}, {corner.y(), velocity.y()}};
}

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
  const auto at_rest = [](const Eigen::Vector2d& point) {
    return Horizontal{Quintic::Point{point.x()}, {point.y()}};
  };
  const Horizontal turn = AtCorner(corner, passing.velocity);
  double largest = 0;
  for (const bool after : {false, true}) {
    std::array<Quintic, 2> way;
    const double duration = after ? 1 - passing.share : passing.share;
    Begin(after ? turn : at_rest(from), after ? at_rest(to) : turn, 0, duration, &way);
    for (int k = 0; k <= kSamples; ++k) {
      const Horizontal at = At(way, duration * k / kSamples);
      largest = std::max(largest, std::hypot(at[0].acceleration, at[1].acceleration));
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
  const double above = start_ + spec.across * (end_ - start_);  // s, the foothold
  const double duration =
      spec.across < 1 ? std::max(above - start_, std::max(spec.freeze, kLeastTime)) : end_ - start_;
  stepping::Begin({point(0), point(1)}, {Quintic::Point{foothold.x()}, {foothold.y()}},
                  start_ + wait, duration - wait, &way_);
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
  const Horizontal from = stepping::At(way_, start_);
  from_ = {from[0].position, from[1].position};
  corner_time_ = end_;
  Turn(from, start_);
}

void Swing::Turn(const Horizontal& from, double time) {
  const Passing passing = PassCorner(from_, corner_, foothold_.head<2>());
  const double whole = end_ - start_;
  const Horizontal turn = AtCorner(corner_, passing.velocity / whole);
  // The first bound, should rounding leave the second below it.
  corner_time_ = std::max(
      time + kLeastTime,
      std::min(start_ + passing.share * whole, std::max(end_, time + 2 * kLeastTime) - kLeastTime));
  stepping::Begin(from, turn, time, corner_time_ - time, &way_);
  stepping::Begin(turn, {Quintic::Point{foothold_.x()}, {foothold_.y()}}, corner_time_,
                  std::max(end_ - corner_time_, kLeastTime), &after_);
}

void Swing::Move(const Eigen::Vector2d& foothold, double time, double end) {
  if (frozen(time)) return;
  end = std::max(end, time + std::max(spec_.freeze, kLeastTime));
  const bool past = Past(time), before = around_ && !past;
  // So near to the corner the pieces stay; a tick or some later the last one moves.
  if (before && time > corner_time_ - 2 * kLeastTime) return;
  foothold_.head<2>() = foothold;
  std::array<Quintic, 2>& piece = past ? after_ : way_;
  const Horizontal now = stepping::At(piece, time);
  if (!before) {
    stepping::Begin(now, {Quintic::Point{foothold.x()}, {foothold.y()}}, time, end - time, &piece);
  }
  MoveEnd(time, end);
  if (before) Turn(now, time);
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

double Swing::Progress(double time) const {
  return std::clamp((time - start_) / (end_ - start_), 0.0, 1.0);
}

PointMotion Swing::At(double time) const {
  const auto [x, y] = stepping::At(Past(time) ? after_ : way_, time);
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
  archive->Show(way_, after_, rise_, fall_, around_, from_, corner_, corner_time_);
  archive->Show(foothold_, start_, apex_, end_, apex_height_, from_rotation_, turn_);
}

}  // namespace poise::stepping
