// The methods of the state estimator over the readings of a run.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "components/framework/graph.pb.h"
#include "logging/metrics/metrics.h"
#include "logging/run_record.h"

namespace poise {

/// Index in the graph of the component that estimates the state (ComponentTraits::methods); empty
/// without one.
std::optional<int> EstimatorOf(const RunSpec& spec);

/// What a method made of a run's readings.
struct Reestimated {
  std::shared_ptr<const logging::Estimates> estimates;
  double tick_time = 0;  ///< us, mean
};
/// Runs the state estimator of `spec` with `method` (METHOD_* of estimator_status_t) over the
/// readings of `run`, from tick 0. `spec` must have one. Throws ConfigError, RobotError.
Reestimated Reestimate(RunSpec spec, int method, const logging::RunRecord& run);

/// Fills in run->other_estimates when one of `metrics` needs them and the run has readings and a
/// state estimator to estimate again. Throws as Reestimate.
void AddOtherEstimates(std::span<const logging::Metric* const> metrics, logging::RunRecord* run);

}  // namespace poise
