#include "components/redistributor/ratio_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "components/balance/minimum_jerk.h"
#include "components/framework/configuration/config_error.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/tick_time.h"

namespace poise {

RatioMoves::RatioMoves(const RedistributorConfig& config) {
  for (int i = 0; i < config.ratio_move_size(); ++i) {
    const RatioMove& move = config.ratio_move(i);
    const std::string field = fmt::format("ratio_move[{}]", i);
    RequireFields(move, {"start", "duration", "position"}, field + ".");
    const double free_from = moves_.empty() ? 0 : moves_.back().start + moves_.back().duration;
    if (move.start() < free_from - kTimeTolerance) {
      throw ConfigError(field + ".start",
                        fmt::format("is {} s, before the move before it ends at {} s; put moves in "
                                    "order, without overlap",
                                    move.start(), free_from));
    }
    moves_.push_back({move.start(), move.duration(), move.position()});
  }
}

double RatioMoves::Ratio(double time, const balance::RatioInterval& interval,
                         double free_ratio) const {
  if (moves_.empty() || time < moves_.front().start || !interval.feasible) return free_ratio;
  const double width = interval.max - interval.min;
  double position = width > 0 ? std::clamp((free_ratio - interval.min) / width, 0.0, 1.0) : 0.0;
  for (const Move& move : moves_) {
    if (time < move.start) break;
    const double share = balance::SmoothStep((time - move.start) / move.duration);
    position = position * (1 - share) + move.position * share;  // both ends exact
  }
  return std::clamp(interval.min + position * width, interval.min, interval.max);
}

}  // namespace poise
