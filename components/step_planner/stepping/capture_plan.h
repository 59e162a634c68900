// The capture point that footsteps ask for, and the centre of pressure that leads it there.
#pragma once

#include <Eigen/Core>
#include <array>

namespace poise::stepping {

/// The centre of pressure along straight pieces, and the capture point ξ of ξ̇ = ω (ξ − p) that
/// ends where it is told to, computed backwards (Englsberger et al. 2015): within a piece of even
/// speed ṗ, ξ(t) = p(t) + ṗ/ω + (ξ_end − p_end − ṗ/ω) e^{−ω (T − t)}. m, s, world. Never allocates.
class CapturePlan {
 public:
  static constexpr int kMostPieces = 9;
  struct Point {
    Eigen::Vector2d capture_point = Eigen::Vector2d::Zero();
    Eigen::Vector2d cop = Eigen::Vector2d::Zero();
  };

  void Clear() { size_ = 0; }
  /// The next piece, `duration` s long, > 0. Beyond kMostPieces none is added.
  void Append(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double duration);
  /// The capture point is `end` when the last piece ends. `frequency`: ω, 1/s.
  void Finish(double frequency, const Eigen::Vector2d& end);
  /// `time`: s from the first piece's begin, held within the plan's span.
  Point At(double time) const;
  int size() const { return size_; }

 private:
  struct Piece {
    Eigen::Vector2d from, to, end;  ///< m; `end`: the capture point's
    double duration = 0;            ///< s
  };
  Point In(const Piece& piece, double time) const;

  std::array<Piece, kMostPieces> piece_;
  int size_ = 0;
  double frequency_ = 1;
};

}  // namespace poise::stepping
