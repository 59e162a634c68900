#include "components/messages/conversions.h"
#include "fmt/format.h"
#include "logging/metric_groups.h"

namespace poise::logging {
namespace {

void AddPush(MetricList* list) {
  list->push_back({"push_peak", "N", "largest push, measured", [](const RunRecord& run) {
                     return Maximum(run, [&](int64_t t) -> Answer {
                       const external_push_t* push = run.push.at(t);
                       if (push == nullptr) return {};
                       return GetVector3(push->force).norm();
                     });
                   }});
  list->push_back({"push_impulse", "N·s", "size of the sum of the measured push over time",
                   [](const RunRecord& run) -> Answer {
                     if (run.push.empty()) return {};
                     Eigen::Vector3d sum = Eigen::Vector3d::Zero();
                     for (int64_t t = run.first_tick; t < run.num_ticks; ++t) {
                       if (const external_push_t* push = run.push.at(t)) {
                         sum += GetVector3(push->force) * run.spec.tick_period();
                       }
                     }
                     return sum.norm();
                   }});
}

void AddEstimator(MetricList* list) {
  const auto add = [&](const char* name, const char* unit, const char* text,
                       double EstimatorError::*field, double scale) {
    const auto value = [field](const RunRecord& run) {
      return [&run, field](int64_t t) -> Answer {
        const auto error = BaseError(run, t);
        if (!error) return {};
        return (*error).*field;
      };
    };
    list->push_back(
        {fmt::format("estimator_{}_max", name), unit,
         fmt::format("estimate less truth of the base's {}, largest", text),
         [=](const RunRecord& run) { return Scaled(Maximum(run, value(run)), scale); }});
    list->push_back(
        {fmt::format("estimator_{}_rms", name), unit,
         fmt::format("estimate less truth of the base's {}, RMS", text),
         [=](const RunRecord& run) { return Scaled(RootMeanSquare(run, value(run)), scale); }});
  };
  add("position", "mm", "position", &EstimatorError::position, kMilli);
  add("velocity", "mm/s", "velocity", &EstimatorError::velocity, kMilli);
  add("tilt", "mrad", "tilt", &EstimatorError::tilt, kMilli);
  add("rotation", "mrad", "rotation", &EstimatorError::rotation, kMilli);
}

}  // namespace

void AddSensors(MetricList* list) {
  AddPush(list);
  AddEstimator(list);
}

}  // namespace poise::logging
