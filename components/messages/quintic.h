// A number's way between two motions.
#pragma once

#include <array>

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

}  // namespace poise
