// The steps that the planner makes of its own, each from its decision to its landing.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "logging/run_record.h"

namespace poise::logging {

struct PlannerStep {
  size_t foot = 0;
  int8_t reason = 0;                                   ///< planner_status_t::REASON_*
  int64_t begin = 0;                                   ///< tick of the decision
  double planned_time = 0;                             ///< s to touch-down, then
  Eigen::Vector2d from = Eigen::Vector2d::Zero();      ///< m, world, the sole's centre then
  Eigen::Vector2d planned = Eigen::Vector2d::Zero();   ///< m, world, the foothold then
  std::optional<int64_t> landing;                      ///< tick; empty: it did not land
  Eigen::Vector2d landed = Eigen::Vector2d::Zero();    ///< m, world, estimated, sole's centre then
  Eigen::Vector2d foothold = Eigen::Vector2d::Zero();  ///< m, world, as last planned
  double margin = 0;          ///< m, capture point inside the soles as it landed; negative: outside
  double planned_margin = 0;  ///< m, the same as planned
};

/// All of the run, in order.
std::vector<PlannerStep> PlannerSteps(const RunRecord& run);

/// "the capture point stays beyond the soles", of REASON_*.
const char* StepReason(int8_t reason);

}  // namespace poise::logging
