#include "fmt/format.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

void Add(MetricList* list, const std::string& name, const char* unit, const std::string& text,
         std::function<Answer(const RunRecord&)> compute) {
  list->push_back({"estimator_" + name, unit, text, std::move(compute)});
}

void AddErrors(MetricList* list) {
  const auto add = [&](const char* name, const char* unit, const char* text,
                       double EstimatorError::*field) {
    const auto value = [field](const RunRecord& run) {
      return OfTick(run.state, run.truth,
                    [field](const robot_state_t& state, const ground_truth_t& truth) {
                      return BaseError(state, truth).*field;
                    });
    };
    Add(list, fmt::format("{}_max", name), unit,
        fmt::format("estimate less truth of the base's {}, largest", text),
        [=](const RunRecord& run) { return Scaled(Maximum(run, value(run)), kMilli); });
    Add(list, fmt::format("{}_rms", name), unit,
        fmt::format("estimate less truth of the base's {}, RMS", text),
        [=](const RunRecord& run) { return Scaled(RootMeanSquare(run, value(run)), kMilli); });
  };
  add("position", "mm", "position", &EstimatorError::position);
  add("velocity", "mm/s", "velocity", &EstimatorError::velocity);
  add("tilt", "mrad", "tilt", &EstimatorError::tilt);
  add("rotation", "mrad", "rotation", &EstimatorError::rotation);
}

void AddNees(MetricList* list, const char* name, const std::string& text, NeesPart part) {
  const auto nees = [part](const RunRecord& run, int64_t t) -> Answer {
    const robot_state_t* state = run.state.at(t);
    const estimator_status_t* status = run.estimator.at(t);
    const ground_truth_t* truth = run.truth.at(t);
    if (state == nullptr || status == nullptr || truth == nullptr) return {};
    return Nees(*state, *status, *truth, part);
  };
  Add(list, fmt::format("{}_share", name), "",
      fmt::format("ticks whose {} lies below {:.2f}, which a right covariance gives for 0.95", text,
                  NeesBound(part)),
      [=](const RunRecord& run) -> Answer {
        int64_t count = 0;
        const Answer inside = CountTicks(run, [&](int64_t t) -> std::optional<bool> {
          const Answer value = nees(run, t);
          if (!value) return {};
          ++count;
          return *value < NeesBound(part);
        });
        if (count == 0) return {};
        return Scaled(inside, 1.0 / static_cast<double>(count));
      });
  Add(list, fmt::format("{}_max", name), "", fmt::format("{}, largest", text),
      [=](const RunRecord& run) { return Maximum(run, [&](int64_t t) { return nees(run, t); }); });
}

void AddFeet(MetricList* list) {
  for (size_t foot = 0; foot < 2; ++foot) {
    Add(list, fmt::format("{}_foot_slip_time", kFoot[foot]), "s",
        fmt::format("time in which the estimator let the {} foot slip, sink or turn", kFoot[foot]),
        [foot](const RunRecord& run) {
          const Answer ticks = CountTicks(run, [&](int64_t t) -> std::optional<bool> {
            const estimator_status_t* status = run.estimator.at(t);
            if (status == nullptr || status->has_covariance == 0) return {};
            return status->foot_contact[foot] == estimator_status_t::CONTACT_SLIPPING;
          });
          return Scaled(ticks, run.spec.tick_period());
        });
  }
}

}  // namespace

void AddEstimator(MetricList* list) {
  AddErrors(list);
  AddNees(list, "nees", "normalised squared error of the base's orientation, velocity and position",
          NeesPart::kAll);
  AddNees(list, "nees_observable", "normalised squared error of the base's tilt and velocity",
          NeesPart::kObservable);
  AddFeet(list);
}

}  // namespace poise::logging
