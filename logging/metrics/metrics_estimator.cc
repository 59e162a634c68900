#include "fmt/format.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

void AddErrors(MetricList* list) {
  const auto add = [&](const std::string& name, const char* unit, const char* text,
                       double EstimatorError::*field) {
    const auto error = Of(
        &RunRecord::state, &RunRecord::truth,
        [field](const auto& state, const auto& truth) { return BaseError(state, truth).*field; });
    list->Add("estimator_" + name + "_max", unit,
              fmt::format("estimate less truth of the base's {}, largest", text),
              Largest(error, kMilli));
    list->Add("estimator_" + name + "_rms", unit,
              fmt::format("estimate less truth of the base's {}, RMS", text), Rms(error, kMilli));
  };
  add("position", "mm", "position", &EstimatorError::position);
  add("velocity", "mm/s", "velocity", &EstimatorError::velocity);
  add("tilt", "mrad", "tilt", &EstimatorError::tilt);
  add("rotation", "mrad", "rotation", &EstimatorError::rotation);
}

void AddNees(MetricList* list, const std::string& name, const std::string& text, NeesPart part) {
  const auto nees = [part](const RunRecord& run, int64_t t) -> Answer {
    const robot_state_t* state = run.state.at(t);
    const estimator_status_t* status = run.estimator.at(t);
    const ground_truth_t* truth = run.truth.at(t);
    if (state == nullptr || status == nullptr || truth == nullptr) return {};
    return Nees(*state, *status, *truth, part);
  };
  const auto inside = [=](const RunRecord& run, int64_t t) -> std::optional<bool> {
    const Answer value = nees(run, t);
    return value ? std::optional(*value < NeesBound(part)) : std::nullopt;
  };
  list->Add("estimator_" + name + "_share", "",
            fmt::format("ticks whose {} lies below {:.2f}, which a right covariance gives for 0.95",
                        text, NeesBound(part)),
            ShareOf(inside));
  list->Add("estimator_" + name + "_max", "", text + ", largest", Largest(nees));
}

}  // namespace

void AddEstimator(MetricList* list) {
  AddErrors(list);
  AddNees(list, "nees", "normalised squared error of the base's orientation, velocity and position",
          NeesPart::kAll);
  AddNees(list, "nees_observable", "normalised squared error of the base's tilt and velocity",
          NeesPart::kObservable);
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto slips = [foot](const estimator_status_t& status) -> std::optional<bool> {
      if (status.has_covariance == 0) return {};
      return status.foot_contact[foot] == estimator_status_t::CONTACT_SLIPPING;
    };
    list->Add(
        fmt::format("estimator_{}_foot_slip_time", kFoot[foot]), "s",
        fmt::format("time in which the estimator let the {} foot slip, sink or turn", kFoot[foot]),
        TimeOf(Of(&RunRecord::estimator, slips)));
  }
}

}  // namespace poise::logging
