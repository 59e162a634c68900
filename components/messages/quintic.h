// Ways by a quintic in time: of a number between two motions, of a point to rest.
#pragma once

#include <Eigen/Core>
#include <array>

#include "components/framework/state_archive.h"
#include "components/messages/motion.h"

namespace poise {

/// Quintic in time between two motions of a number; straight on with the last velocity after. Its
/// bytes are its state.
class Quintic {
 public:
  struct Point {
    double position = 0, velocity = 0, acceleration = 0;
  };
  /// From `from` at `start` to `to` at start + duration, s, > 0.
  void Begin(const Point& from, const Point& to, double start, double duration);
  Point At(double time) const;

 private:
  std::array<double, 6> coefficient_{};  // of powers of (time − start) / duration
  double start_ = 0, duration_ = 1;
};

/// Quintic in time from a given motion to rest at a target; from rest it is the minimum-jerk line.
/// Holds before and after.
class QuinticMove {
 public:
  QuinticMove() { Hold(Eigen::Vector3d::Zero()); }
  /// Rests at `position` for all time.
  void Hold(const Eigen::Vector3d& position);
  /// Moves from `from` at `start` to rest at `target` at start + duration, s. Duration 0 is a step.
  void Begin(const PointMotion& from, const Eigen::Vector3d& target, double start, double duration);
  PointMotion At(double time) const;
  bool UnderWay(double time) const { return time > start_ && time < start_ + duration_; }
  bool Ended(double time) const { return time >= start_ + duration_; }
  /// What is left of it comes later by `delay`, s.
  void Postpone(double delay) { start_ += delay; }
  void Archive(StateArchive* archive) { archive->Show(coefficient_, start_, duration_); }

 private:
  std::array<Eigen::Vector3d, 6> coefficient_;  // of powers of (time − start) / duration
  double start_ = 0;
  double duration_ = 0;
};

}  // namespace poise
