#include <algorithm>
#include <cmath>
#include <optional>

#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

constexpr int kMostDelay = 5;  // ticks

double TorquePerAmpere(const RunRecord& run, size_t joint) {
  return run.robot.motors()[joint].torque_per_ampere();
}

/// Deviation, N·m, of the drives' torque from what the bridge ordered `delay` ticks before.
struct Deviation {
  int delay;
  double largest = 0;
  double squares = 0;
  int64_t count = 0;
};

Deviation DeviationAt(const RunRecord& run, int delay) {
  Deviation result{delay};
  for (int64_t tick = std::max<int64_t>(run.first_tick, kMostDelay); tick < run.num_ticks; ++tick) {
    const drive_command_t* drive = run.drive.at(tick);
    const bridge_status_t* bridge = run.bridge.at(tick - delay);
    if (drive == nullptr || bridge == nullptr) continue;
    for (size_t j = 0; j < run.robot.joints().size(); ++j) {
      const double error =
          std::abs(drive->current[j] * TorquePerAmpere(run, j) - bridge->applied_torque[j]);
      result.largest = std::max(result.largest, error);
      result.squares += error * error;
      ++result.count;
    }
  }
  return result;
}

/// At the delay at which the drives' torque is nearest to the bridge's; empty: nothing to compare.
std::optional<Deviation> LeastDeviation(const RunRecord& run) {
  std::optional<Deviation> least;
  for (int delay = 0; delay <= kMostDelay; ++delay) {
    const Deviation deviation = DeviationAt(run, delay);
    const bool farther = least && deviation.squares >= least->squares;
    if (deviation.count > 0 && !farther) least = deviation;
  }
  return least;
}

/// Smallest change of a drive's torque from tick to tick: its quantisation, where it has one.
Answer TorqueStep(const RunRecord& run) {
  constexpr double kNoStep = 1e-9;  // N·m: rounding
  Answer smallest;
  for (int64_t tick = run.first_tick + 1; tick < run.num_ticks; ++tick) {
    const drive_command_t* before = run.drive.at(tick - 1);
    const drive_command_t* now = run.drive.at(tick);
    if (before == nullptr || now == nullptr) continue;
    for (size_t j = 0; j < run.robot.joints().size(); ++j) {
      const double step = std::abs(now->current[j] - before->current[j]) * TorquePerAmpere(run, j);
      if (step > kNoStep && (!smallest || step < *smallest)) smallest = step;
    }
  }
  return smallest;
}

}  // namespace

void AddDrives(MetricList* list) {
  list->Add("drive_torque_step", "N·m",
            "smallest change of a joint's torque that the drives have made", TorqueStep);
  list->Add("drive_torque_error", "N·m",
            "largest difference between a joint's torque as the bridge ordered it and as the "
            "drives gave it, at the delay between them",
            [](const RunRecord& run) {
              const auto deviation = LeastDeviation(run);
              return deviation ? Answer(deviation->largest) : Answer();
            });
  list->Add("drive_delay", "ticks",
            "delay from the bridge's torque to the drives', at which they agree best",
            [](const RunRecord& run) {
              const auto deviation = LeastDeviation(run);
              return deviation ? Answer(deviation->delay) : Answer();
            });
  const auto add = [&](const char* name, const char* text, int64_t bridge_status_t::*counter) {
    list->Add(name, "", text, [counter](const RunRecord& run) -> Answer {
      for (int64_t tick = run.num_ticks - 1; tick >= run.first_tick; --tick) {
        const bridge_status_t* const bridge = run.bridge.at(tick);
        if (bridge != nullptr) return static_cast<double>(bridge->*counter);
      }
      return {};
    });
  };
  add("bus_frames_sent", "EtherCAT frames that the bridge has sent", &bridge_status_t::frames_sent);
  add("bus_frames_lost", "EtherCAT frames that have not come back in time",
      &bridge_status_t::frames_lost);
  add("bus_working_counter_errors", "EtherCAT frames that not all drives have answered",
      &bridge_status_t::working_counter_errors);
  add("bridge_overruns", "cycles of the bridge that began too late", &bridge_status_t::overruns);
}

}  // namespace poise::logging
