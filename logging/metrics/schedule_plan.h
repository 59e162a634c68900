// What the scenario planned, read from the run's own configuration.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "logging/run_record.h"

namespace poise::logging {

/// Where a phase sends the foot that is off the ground.
struct FootPlan {
  int foot = 0;
  double z = 0;  ///< m, shift of its reference, or height above the other sole
  bool above_support = false;
  bool at_once = false;  ///< a step: the reference stands at its end from the phase's first tick
};

/// A phase of the schedule.
struct PhasePlan {
  std::string name;
  bool double_support = false;
  std::optional<FootPlan> foot;
  int next = -1;  ///< phase that follows when this one is done; -1: none
};

/// Reads the schedule of the component that writes SUPPORT_PLAN. Empty when the run names no such
/// configuration, when it does not fit this version's schema, or when the program does not link
/// that schema: logging knows it by name only, since it includes no component's folder.
std::optional<std::vector<PhasePlan>> ReadSchedulePlan(const RunRecord& run);

/// A velocity that is to be walked from a time on, and once so many steps have begun.
struct WalkOrder {
  double time = 0;                                     ///< s
  int after_steps = 0;                                 ///< since the run's start
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s ahead and to the left, rad/s
};

/// What the run's scenario commands its robot to walk, in order, whoever is to walk it: a graph
/// need not have Poise's planner. Without a scenario that this program can read, what the component
/// that writes SUPPORT_PLAN was configured with. Empty: nothing.
std::vector<WalkOrder> ReadWalkOrders(const RunRecord& run);

}  // namespace poise::logging
