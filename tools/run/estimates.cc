#include "tools/run/estimates.h"

#include <algorithm>
#include <string_view>

#include "components/framework/clock.h"
#include "components/framework/graph.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

template <class Message, class Port>
Port* FindPort(const std::vector<Port*>& ports) {
  const auto found = std::find_if(ports.begin(), ports.end(), [](const Port* port) {
    return std::string_view(port->type_name()) == Message::getTypeName();
  });
  return *found;  // an estimator has one of each type
}

}  // namespace

std::optional<int> EstimatorOf(const RunSpec& spec) {
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    if (!Components().TraitsOf(TypeOf(spec.graph().component(i))).methods.empty()) return i;
  }
  return {};
}

Reestimated Reestimate(RunSpec spec, int method, const logging::RunRecord& run) {
  const int index = EstimatorOf(spec).value();
  const std::string& type = TypeOf(spec.graph().component(index));
  ChangeConfigurations({Components().TraitsOf(type).methods.at(static_cast<size_t>(method))},
                       &spec);
  SharedObjects shared;
  const ConfiguredComponent estimator =
      ConfigureComponent(spec, index, *Components().Find(type), &shared);
  InputPort* sensors = FindPort<robot_sensors_t>(estimator.wiring.inputs());
  const OutputPort* state = FindPort<robot_state_t>(estimator.wiring.outputs());
  const OutputPort* status = FindPort<estimator_status_t>(estimator.wiring.outputs());
  auto estimates = std::make_shared<logging::Estimates>();
  std::optional<logging::PagedAppender<robot_state_t>> paged_state;
  std::optional<logging::PagedAppender<estimator_status_t>> paged_status;
  if (run.paged) {
    paged_state.emplace(&estimates->state);
    paged_status.emplace(&estimates->status);
  }
  int64_t ticks = 0, time = 0;
  for (int64_t t = 0; t < run.num_ticks; ++t) {
    const robot_sensors_t* readings = run.sensors.at(t);
    if (readings == nullptr) continue;  // as in a run that skips ticks
    sensors->Bind(readings);
    const Tick tick = MakeTick(t, spec.tick_period(), spec.lead_ticks());
    for (OutputPort* output : estimator.wiring.outputs()) {
      output->Stamp(spec.run_id(), tick.index, tick.utime);
    }
    const int64_t start = NowNanoseconds();
    for (const Stage& stage : estimator.wiring.stages()) stage.run(tick);
    time += NowNanoseconds() - start;
    ++ticks;
    const auto& state_now = *static_cast<const robot_state_t*>(state->message());
    const auto& status_now = *static_cast<const estimator_status_t*>(status->message());
    if (run.paged) {
      paged_state->Set(t, state_now);
      paged_status->Set(t, status_now);
    } else {
      estimates->state.Set(t, state_now);
      estimates->status.Set(t, status_now);
    }
  }
  sensors->Bind(nullptr);
  const double tick_time =
      ticks > 0 ? 1e-3 * static_cast<double>(time) / static_cast<double>(ticks) : 0;
  return {std::move(estimates), tick_time};
}

void AddOtherEstimates(std::span<const logging::Metric* const> metrics, logging::RunRecord* run) {
  const bool needed = std::ranges::any_of(
      metrics, [](const logging::Metric* metric) { return metric->needs_other_estimates; });
  if (!needed || run->sensors.empty() || run->truth.empty() || !EstimatorOf(run->spec)) return;
  const estimator_status_t* ran = nullptr;
  for (int64_t t = 0; t < run->num_ticks && ran == nullptr; ++t) ran = run->estimator.at(t);
  for (size_t method = 0; method < run->other_estimates.size(); ++method) {
    const int m = static_cast<int>(method);
    if (ran != nullptr && ran->method == m) continue;
    run->other_estimates[method] = Reestimate(run->spec, m, *run).estimates;
  }
}

}  // namespace poise
