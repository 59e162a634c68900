#include "components/messages/conversions.h"
#include "logging/metrics/metric_groups.h"

namespace poise::logging {
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
