// What the ground felt and where the robot was: told by GROUND_TRUTH, whoever the controller is.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "logging/metrics/contact_history.h"

namespace poise::logging {

/// Times [begin, end) in which each foot carried nothing: less than 2 % of the robot's weight for
/// at least 0.1 s, a touch of up to 20 ms counted in. Up to the tick in which the robot is down;
/// none without GROUND_TRUTH.
std::array<std::vector<Interval>, 2> OffTheGround(const RunRecord& run);

/// A foot that left the ground and carries again, at least 50 mm from where it stood, or in turn
/// with the other foot, three times at least, each at most 1 s after the one before: a robot that
/// rocks, and a sole that soft ground throws off, make no step. A foot that has been in the air
/// from the start steps wherever it comes down.
struct TrueStep {
  size_t foot = 0;
  int64_t lifted = 0, landed = 0;  ///< ticks, of the scenario's time
};
/// All of the run, by their landings.
std::vector<TrueStep> TrueSteps(const RunRecord& run);

/// Which feet carried, right first, and since when: changes in order, the first at time 0. Empty
/// where no foot ever carried, or without GROUND_TRUTH.
struct TrueSupport {
  int64_t tick = 0;
  std::array<bool, 2> carries{};
};
std::vector<TrueSupport> TrueSupports(const RunRecord& run);

/// True when the robot is down at `tick`: the simulator calls it fallen, its body is tilted by more
/// than 1 rad from how it stood at time 0, or its COM has less than half the height above the lower
/// sole that it had then (before time 0 the simulator alone says so). While no foot bears 2 % of
/// the weight, its height above the ground of time 0 counts where that is more. Empty without
/// GROUND_TRUTH.
std::optional<bool> IsDown(const RunRecord& run, int64_t tick);
/// The first tick in which it is down; empty when there is none.
std::optional<int64_t> DownTick(const RunRecord& run);
/// m, height of the true COM above the lower sole.
double ComHeight(const ground_truth_t& truth);

}  // namespace poise::logging
