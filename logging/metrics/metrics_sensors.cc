#include "components/messages/conversions.h"
#include "logging/metrics/metric_groups.h"

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

}  // namespace

void AddSensors(MetricList* list) { AddPush(list); }

}  // namespace poise::logging
