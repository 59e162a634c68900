#include "components/step_planner/stepping/capture_plan.h"

#include <algorithm>
#include <cmath>

namespace poise::stepping {

using Eigen::Vector2d;

void CapturePlan::Append(const Vector2d& from, const Vector2d& to, double duration) {
  if (size_ >= kMostPieces) return;
  const auto next = static_cast<size_t>(size_++);
  piece_[next] = {from, to, Vector2d::Zero(), duration};
}

void CapturePlan::Finish(double frequency, const Vector2d& end) {
  frequency_ = frequency;
  Vector2d last = end;
  for (int i = size_ - 1; i >= 0; --i) {
    Piece& piece = piece_[static_cast<size_t>(i)];
    piece.end = last;
    last = In(piece, 0).capture_point;
  }
}

CapturePlan::Point CapturePlan::In(const Piece& piece, double time) const {
  const double left = piece.duration - time;
  const Vector2d speed = (piece.to - piece.from) / piece.duration, lead = speed / frequency_;
  Point point;
  point.cop = piece.to - left * speed;
  point.capture_point =
      point.cop + lead + std::exp(-frequency_ * left) * (piece.end - piece.to - lead);
  return point;
}

CapturePlan::Point CapturePlan::At(double time) const {
  if (size_ == 0) return {};
  time = std::max(time, 0.0);
  size_t i = 0;
  for (; i + 1 < static_cast<size_t>(size_) && time > piece_[i].duration; ++i) {
    time -= piece_[i].duration;
  }
  return In(piece_[i], std::min(time, piece_[i].duration));
}

}  // namespace poise::stepping
