#include <Eigen/Core>
#include <algorithm>

#include "components/messages/conversions.h"
#include "components/messages/touch_load.h"
#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

// Share of the weight from which on a foot has a centre of pressure worth comparing.
constexpr double kCopShare = 0.25;
// N of the true load: a touch-down, and below which, as long, nothing was touched. Whatever the run
// asks for, it is what the planner asks for by default.
double TrueTouchLoad() { return ContactConfirmation().touch_load(); }
double NoLoad() { return ReleaseLoad(ContactConfirmation()); }
constexpr double kWrenchNeesBound = 21.026;  // chi-squared, 12 degrees of freedom, 5 %

double WeightOf(const RunRecord& run) { return run.robot.total_mass() * robot::kGravity; }

struct Compared {
  Wrench observed, truth;
};

/// Returns one foot's wrenches; empty without observer.
std::optional<Compared> WrenchesAt(const RunRecord& run, size_t foot, int64_t tick) {
  const estimator_status_t* status = run.estimator.at(tick);
  const ground_truth_t* truth = run.truth.at(tick);
  if (status == nullptr || truth == nullptr || status->has_observer == 0) return {};
  return Compared{GetWrench(status->observed_wrench[foot]), GetWrench(truth->foot_wrench[foot])};
}

/// RMS and maximum of the larger of both feet's `value`.
template <class Value>
void AddObserverErrors(MetricList* list, const char* name, const char* unit, const char* text,
                       const Value& value) {
  const auto worse = [value](const RunRecord& run, int64_t tick) {
    Answer result;
    for (size_t foot = 0; foot < 2; ++foot) {
      const auto compared = WrenchesAt(run, foot, tick);
      if (compared) result = std::max(result, Answer(value(run, *compared)));
    }
    return result;
  };
  const std::string what = fmt::format("observed less true {}, of the worse foot, ", text);
  list->Add(fmt::format("observer_{}_rms", name), unit, what + "RMS", Rms(worse));
  list->Add(fmt::format("observer_{}_max", name), unit, what + "largest", Largest(worse));
}

/// Whether the normalised squared error of both wrenches is within the bound.
std::optional<bool> WithinBound(const RunRecord& run, int64_t tick) {
  const auto right = WrenchesAt(run, 0, tick), left = WrenchesAt(run, 1, tick);
  if (!right || !left) return {};
  Eigen::VectorXd error(12);
  error << right->observed - right->truth, left->observed - left->truth;
  const Answer nees =
      NormalisedSquare(error, FromTriangle(run.estimator.at(tick)->observed_covariance, 12));
  return nees ? std::optional(*nees < kWrenchNeesBound) : std::nullopt;
}

/// The tick at which the foot's true load, that of `tick`, has been above TrueTouchLoad for
/// kTouchTime; empty where it is not above it at `tick`.
std::optional<int64_t> TrueTouch(const RunRecord& run, size_t foot, int64_t tick) {
  const auto lasts = static_cast<int64_t>(std::lround(kTouchTime / run.spec.tick_period()));
  const auto loaded = [&, least = TrueTouchLoad()](int64_t t) {
    const ground_truth_t* truth = run.truth.at(t);
    return truth != nullptr && -truth->foot_wrench[foot].force[2] > least;
  };
  if (!loaded(tick)) return {};
  int64_t begin = tick;
  while (begin > 0 && loaded(begin - 1)) --begin;
  return begin + lasts;
}

/// Whether the foot's true load was nowhere above NoLoad in the kTouchTime before `tick`.
bool TouchedNothing(const RunRecord& run, size_t foot, int64_t tick) {
  const auto lasts = static_cast<int64_t>(std::lround(kTouchTime / run.spec.tick_period()));
  for (int64_t t = std::max<int64_t>(tick - lasts, 0); t <= tick; ++t) {
    const ground_truth_t* truth = run.truth.at(t);
    if (truth == nullptr || -truth->foot_wrench[foot].force[2] > NoLoad()) return false;
  }
  return true;
}

// s: what the calibration is asked for at, and how long its figures are averaged.
constexpr double kCalibrated = 2, kAveraged = 0.2;

/// Mean of what `signal` tells in the kAveraged before the run's end, or before kCalibrated; empty
/// when the run is shorter.
template <class Signal>
Compute MeanBefore(bool end, Signal signal) {
  return [=](const RunRecord& run) -> Answer {
    const double time = end ? run.time(run.num_ticks) : kCalibrated;
    const auto value = ByTick(signal, run);
    Mean mean;
    for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
      if (run.time(tick) > time || run.time(tick) < time - kAveraged) continue;
      if (const Answer v = value(tick)) mean.Add(*v);
    }
    return run.time(run.num_ticks) < time ? Answer() : mean.Value();
  };
}

/// %, of what the ground carries.
Answer MassError(const RunRecord& run, int64_t tick) {
  const robot_state_t* state = run.state.at(tick);
  const ground_truth_t* truth = run.truth.at(tick);
  // A controller that tells no task need not believe in the model's mass.
  if (state == nullptr || truth == nullptr || run.task.empty()) return {};
  double force = 0;
  for (size_t f = 0; f < 2; ++f) {
    force += (GetPose(truth->foot_pose[f]).linear() * GetVector3(truth->foot_wrench[f].force)).z();
  }
  const double carried = -force / robot::kGravity;
  return 100 * (run.robot.total_mass() + state->load_mass - carried) / carried;
}

void AddCalibration(MetricList* list) {
  for (const bool end : {false, true}) {
    const std::string when = end ? "end" : "2s";
    const std::string text = end ? "at the end" : "after 2 s";
    list->Add("mass_error_" + when, "%",
              "mass that the controller believes in less what the ground carries, " + text,
              MeanBefore(end, MassError));
    for (int axis = 0; axis < 3; ++axis) {
      const auto error = [axis](const auto& planner, const auto& truth) {
        return kMilli * (planner.com_position[axis] - truth.com_position[axis]);
      };
      list->Add(fmt::format("com_estimate_error_{}_{}", kAxis[axis], when), "mm",
                fmt::format("estimated less true COM, {}, {}", kAxis[axis], text),
                MeanBefore(end, Of(&RunRecord::planner, &RunRecord::truth, error)));
    }
    for (int axis = 0; axis < 2; ++axis) {
      const auto tilt = [axis](const estimator_status_t& status) -> Answer {
        if (status.calibration == estimator_status_t::CALIBRATION_OFF) return {};
        return kMilli * status.imu_tilt[axis];
      };
      list->Add(fmt::format("imu_tilt_{}_{}", kAxis[axis], when), "mrad",
                fmt::format("tilt of the IMU about its {}, as found, {}", kAxis[axis], text),
                MeanBefore(end, Of(&RunRecord::estimator, tilt)));
    }
  }
}

/// ms.
Answer TouchDownDelay(const RunRecord& run) {
  Answer worst;
  for (const TouchDown& touch : TouchDowns(run)) {
    if (TouchedNothing(run, touch.foot, touch.tick)) continue;
    const auto truth = TrueTouch(run, touch.foot, touch.tick);
    const int64_t late = truth ? touch.tick - *truth : 0;
    worst = std::max(worst.value_or(0), kMilli * run.duration(late));
  }
  return worst;
}

Answer FalseTouchDowns(const RunRecord& run) {
  if (run.planner.empty() || run.truth.empty()) return {};
  return static_cast<double>(std::ranges::count_if(TouchDowns(run), [&](const TouchDown& touch) {
    return TouchedNothing(run, touch.foot, touch.tick);
  }));
}

}  // namespace

void AddObserver(MetricList* list) {
  AddCalibration(list);
  AddObserverErrors(list, "force", "%", "foot force, share of the weight",
                    [](const RunRecord& run, const Compared& c) {
                      return 100 * (c.observed - c.truth).head<3>().norm() / WeightOf(run);
                    });
  AddObserverErrors(
      list, "cop", "mm", "centre of pressure in the sole, of feet with a quarter of the weight",
      [](const RunRecord& run, const Compared& c) -> Answer {
        if (-c.truth[2] < kCopShare * WeightOf(run) || !(c.observed[2] < 0)) return {};
        const auto cop = [](const Wrench& w) { return Eigen::Vector2d(-w[4] / w[2], w[3] / w[2]); };
        return kMilli * (cop(c.observed) - cop(c.truth)).norm();
      });
  list->Add("observer_nees_share", "",
            "ticks whose normalised squared error of both observed foot wrenches lies below 21.03, "
            "which a right covariance gives for 0.95",
            ShareOf(WithinBound));
  list->Add("touch_down_delay_max", "ms",
            fmt::format("touch-downs as planned for, later than when the true load had been above "
                        "{} N for {} ms, largest; 0 of those that came before",
                        TrueTouchLoad(), kMilli * kTouchTime),
            TouchDownDelay);
  list->Add("false_touch_downs", "",
            fmt::format("touch-downs as planned for, of feet whose true load had not been above {} "
                        "N in the {} ms before",
                        NoLoad(), kMilli * kTouchTime),
            FalseTouchDowns);
  const auto broken = Of(&RunRecord::estimator, [](const auto& status) {
    return std::ranges::any_of(
        status.foot_sensor, [](int8_t state) { return state > estimator_status_t::SENSOR_ABSENT; });
  });
  list->Add("foot_sensor_fault_first", "s",
            "first time at which a foot's sensor was taken for broken", FirstTime(broken));
  list->Add("foot_sensor_fault_time", "s",
            "time in which a foot's sensor was taken for broken (a robot without sensors has none)",
            TimeOf(broken));
}

}  // namespace poise::logging
