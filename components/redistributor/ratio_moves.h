// The ratio η led through its feasible interval by a schedule, instead of chosen by the appendix.
#pragma once

#include <vector>

#include "components/balance/distribution_ratio.h"
#include "components/redistributor/redistributor.pb.h"

namespace poise {

/// Pure function of the time and of one tick's interval.
class RatioMoves {
 public:
  RatioMoves() = default;
  /// Throws ConfigError "ratio_move[1].start" ...: missing, not finite, out of range, or beginning
  /// before the move before it ends.
  explicit RatioMoves(const RedistributorConfig& config);

  /// η at `time`, s, within `interval`; `free_ratio`, the appendix's choice, before the first move
  /// and without a feasible interval. A move runs by minimum jerk in the position within the
  /// interval, the first one from the position of `free_ratio`.
  double Ratio(double time, const balance::RatioInterval& interval, double free_ratio) const;

 private:
  struct Move {
    double start, duration;  // s
    double position;         // 0..1
  };
  std::vector<Move> moves_;
};

}  // namespace poise
