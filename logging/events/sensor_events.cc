#include <algorithm>
#include <array>
#include <cmath>

#include "fmt/format.h"
#include "logging/events/event_groups.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"

namespace poise::logging {
namespace {

constexpr double kKnownHeight = 5;  // mm, standard deviation of a COM that is known

const char* SensorFaultText(int8_t state) {
  switch (state) {
    case estimator_status_t::SENSOR_INVALID:
      return "gives no valid reading";
    case estimator_status_t::SENSOR_DEAD:
      return "reads zero";
    case estimator_status_t::SENSOR_FROZEN:
      return "reads the same all the time";
    case estimator_status_t::SENSOR_BIASED:
      return "differs from what the joints' torques show";
    default:
      return nullptr;
  }
}

void AddFootSensors(const RunRecord& run, EventList* events) {
  for (size_t foot = 0; foot < 2; ++foot) {
    const auto broken = OfTick(run.estimator, [&](const estimator_status_t& status) {
      return SensorFaultText(status.foot_sensor[foot]) != nullptr;
    });
    events->AddIntervals(
        Intervals(run, broken), "foot_sensor_fault", "foot_sensor_back", [&](int64_t tick) {
          return fmt::format("{}: its sensor {}; its wrench is observed", FootName(run, foot),
                             SensorFaultText(run.estimator.at(tick)->foot_sensor[foot]));
        });
  }
}

// What calibration has found by the run's end, and what standing does not tell.
void AddCalibration(const RunRecord& run, EventList* events) {
  const estimator_status_t* last = nullptr;
  bool ran = false;
  for (const auto& [tick, status] : Messages(run.estimator, run.first_tick, run.num_ticks)) {
    last = status;
    ran = ran || status->calibration == estimator_status_t::CALIBRATION_RUNNING;
  }
  if (last == nullptr || last->calibration == estimator_status_t::CALIBRATION_OFF) return;
  if (!ran) {
    events->Add(run.num_ticks, "calibration",
                "found nothing: it needs sensors in both feet and a robot that stands still");
    return;
  }
  // Places of load_mass and load_moment on the diagonal of a packed 6 x 6 triangle.
  constexpr std::array<size_t, 4> kDiagonal = {0, 6, 11, 15};
  const double mass = run.robot.total_mass();
  std::array<double, 3> shift{}, deviation{};  // mm of the whole robot's COM
  for (size_t i = 0; i < 3; ++i) {
    shift[i] = kMilli * last->load_moment[i] / mass;
    deviation[i] =
        kMilli * std::sqrt(std::max(last->calibration_covariance[kDiagonal[i + 1]], 0.0)) / mass;
  }
  events->Add(
      run.num_ticks, "calibration",
      fmt::format(
          "load {:.2f} ± {:.2f} kg, which moves the COM by {:.1f} ± {:.1f}, {:.1f} ± {:.1f}, "
          "{:.1f} ± {:.1f} mm{}; IMU turned by {:.1f}, {:.1f} mrad, its "
          "accelerometer's bias as an angle included",
          last->load_mass, std::sqrt(std::max(last->calibration_covariance[0], 0.0)), shift[0],
          deviation[0], shift[1], deviation[1], shift[2], deviation[2],
          deviation[2] > kKnownHeight ? " (along z standing still does not tell it)" : "",
          kMilli * last->imu_tilt[0], kMilli * last->imu_tilt[1]));
}

}  // namespace

void AddSensorEvents(const RunRecord& run, EventList* events) {
  AddFootSensors(run, events);
  AddCalibration(run, events);
}

}  // namespace poise::logging
