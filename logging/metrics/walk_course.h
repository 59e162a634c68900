// How far the robot went, in truth, where it was commanded to walk.
#pragma once

#include "logging/run_record.h"

namespace poise::logging {

/// Sums over the ticks from RunRecord::first_tick on in which the scenario commands a velocity, up
/// to an operator's first act on it. Commands are of the robot's heading, so they are held against
/// the true COM's way along that of each tick.
struct WalkCourse {
  double way = 0;             ///< m, along the command; against it less
  double commanded_way = 0;   ///< m
  double turn = 0;            ///< rad, in the command's sense; against it less
  double commanded_turn = 0;  ///< rad
};

/// What is gone or turned after the robot is down counts for nothing. Without GROUND_TRUTH only
/// what is commanded is known.
WalkCourse FollowedCourse(const RunRecord& run);

/// rad, about the vertical: where the base's x axis points.
double Heading(const ground_truth_t& truth);

}  // namespace poise::logging
