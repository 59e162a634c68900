#include <algorithm>
#include <cmath>
#include <vector>

#include "components/messages/conversions.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/push_noise.h"

namespace poise::logging {

double PushThreshold(const RunRecord& run) {
  constexpr double kDeviations = 6;  // of a norm of three: beyond it once in 10^7 samples
  constexpr size_t kFewest = 10;     // differences
  // The norm of three normal variables of deviation 1 has this median; a difference of two, √2 of
  // it.
  const double median_of_difference = 1.5382 * std::sqrt(2.0);
  std::vector<double> differences;
  for (int64_t tick = 1; tick < run.num_ticks; ++tick) {
    const external_push_t* before = run.push.at(tick - 1);
    if (before == nullptr) continue;
    const Eigen::Vector3d force = GetVector3(before->force);  // of a paged series
    const external_push_t* now = run.push.at(tick);
    if (now != nullptr) differences.push_back((GetVector3(now->force) - force).norm());
  }
  if (differences.size() < kFewest) return HUGE_VAL;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return kDeviations * *middle / median_of_difference;
}

namespace {

/// N; none where nothing stands out of the sensor's noise.
Answer PushPeak(const RunRecord& run) {
  const double threshold = PushThreshold(run);
  return Maximum(run, OfTick(run.push, [&](const external_push_t& push) {
                   const double force = GetVector3(push.force).norm();
                   return force > threshold ? Answer(force) : Answer();
                 }));
}

Answer PushImpulse(const RunRecord& run) {
  if (!PushPeak(run)) return {};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [tick, push] : Messages(run.push, run.first_tick, run.num_ticks)) {
    sum += GetVector3(push->force) * run.spec.tick_period();
  }
  return sum.norm();
}

}  // namespace

void AddSensors(MetricList* list) {
  list->Add("push_peak", "N", "largest push, measured; none: all is the sensor's noise", PushPeak);
  list->Add("push_impulse", "N·s", "size of the sum of the measured push over time", PushImpulse);
}

}  // namespace poise::logging
