#include "fmt/format.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

/// Which estimate a metric is of.
struct Source {
  const char* prefix;
  const char* text;
  int method;  // METHOD_*; kAsRun: the one that ran
};
constexpr int kAsRun = -1;
constexpr Source kSources[] = {
    {"estimator", "", kAsRun},
    {"anchored_feet", " by the method ANCHORED_FEET, of the same readings",
     estimator_status_t::METHOD_ANCHORED_FEET},
    {"invariant_ekf", " by the method INVARIANT_EKF, of the same readings",
     estimator_status_t::METHOD_INVARIANT_EKF},
};

struct Estimate {
  const robot_state_t* state = nullptr;
  const estimator_status_t* status = nullptr;
};

Estimate At(const RunRecord& run, int method, int64_t tick) {
  const estimator_status_t* ran = run.estimator.at(tick);
  if (method == kAsRun || (ran != nullptr && ran->method == method)) {
    return {run.state.at(tick), ran};
  }
  const auto& other = run.other_estimates[static_cast<size_t>(method)];
  if (other == nullptr) return {};
  return {other->state.at(tick), other->status.at(tick)};
}

void Add(MetricList* list, const Source& source, const std::string& name, const char* unit,
         const std::string& text, std::function<Answer(const RunRecord&)> compute) {
  list->push_back({fmt::format("{}_{}", source.prefix, name), unit, text + source.text,
                   std::move(compute), source.method != kAsRun});
}

void AddErrors(MetricList* list, const Source& source) {
  const auto add = [&](const char* name, const char* unit, const char* text,
                       double EstimatorError::*field) {
    const auto value = [field, method = source.method](const RunRecord& run) {
      return [&run, field, method](int64_t t) -> Answer {
        const Estimate estimate = At(run, method, t);
        const ground_truth_t* truth = run.truth.at(t);
        if (estimate.state == nullptr || truth == nullptr) return {};
        return BaseError(*estimate.state, *truth).*field;
      };
    };
    Add(list, source, fmt::format("{}_max", name), unit,
        fmt::format("estimate less truth of the base's {}, largest", text),
        [=](const RunRecord& run) { return Scaled(Maximum(run, value(run)), kMilli); });
    Add(list, source, fmt::format("{}_rms", name), unit,
        fmt::format("estimate less truth of the base's {}, RMS", text),
        [=](const RunRecord& run) { return Scaled(RootMeanSquare(run, value(run)), kMilli); });
  };
  add("position", "mm", "position", &EstimatorError::position);
  add("velocity", "mm/s", "velocity", &EstimatorError::velocity);
  add("tilt", "mrad", "tilt", &EstimatorError::tilt);
  add("rotation", "mrad", "rotation", &EstimatorError::rotation);
}

void AddNees(MetricList* list, const Source& source, const char* name, const std::string& text,
             NeesPart part) {
  const auto nees = [part, method = source.method](const RunRecord& run, int64_t t) -> Answer {
    const Estimate estimate = At(run, method, t);
    const ground_truth_t* truth = run.truth.at(t);
    if (estimate.state == nullptr || estimate.status == nullptr || truth == nullptr) return {};
    return Nees(*estimate.state, *estimate.status, *truth, part);
  };
  Add(list, source, fmt::format("{}_share", name), "",
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
  Add(list, source, fmt::format("{}_max", name), "", fmt::format("{}, largest", text),
      [=](const RunRecord& run) { return Maximum(run, [&](int64_t t) { return nees(run, t); }); });
}

void AddFeet(MetricList* list, const Source& source) {
  for (size_t foot = 0; foot < 2; ++foot) {
    Add(list, source, fmt::format("{}_foot_slip_time", kFoot[foot]), "s",
        fmt::format("time in which the estimator let the {} foot slip, sink or turn", kFoot[foot]),
        [foot, method = source.method](const RunRecord& run) {
          const Answer ticks = CountTicks(run, [&](int64_t t) -> std::optional<bool> {
            const estimator_status_t* status = At(run, method, t).status;
            if (status == nullptr || status->has_covariance == 0) return {};
            return status->foot_contact[foot] == estimator_status_t::CONTACT_SLIPPING;
          });
          return Scaled(ticks, run.spec.tick_period());
        });
  }
}

}  // namespace

void AddEstimator(MetricList* list) {
  for (const Source& source : kSources) {
    AddErrors(list, source);
    if (source.method == estimator_status_t::METHOD_ANCHORED_FEET) continue;  // no covariance
    AddNees(list, source, "nees",
            "normalised squared error of the base's orientation, velocity and position",
            NeesPart::kAll);
    AddNees(list, source, "nees_observable",
            "normalised squared error of the base's tilt and velocity", NeesPart::kObservable);
    AddFeet(list, source);
  }
}

}  // namespace poise::logging
