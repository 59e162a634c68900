#include "logging/recording/inline_recorder.h"

#include <algorithm>

#include "components/framework/run.h"

namespace poise::logging {

InlineRecorder::InlineRecorder(const std::string& path, const RunSpec& spec, const run_info_t& info,
                               InlineRunner* runner, InlineRecord* kept)
    : writer_(path, spec, info), runner_(runner) {
  runner->set_tap([this, kept](int channel, const OutputPort& output, const Tick& tick) {
    Add(channel, output, tick);
    if (kept != nullptr) kept->Add(channel, output, tick);
  });
  runner->set_external_tap(
      [this](int channel, std::span<const uint8_t> data) { AddExternal(channel, data); });
}

void InlineRecorder::Add(int channel, const OutputPort& output, const Tick& tick) {
  const auto size = static_cast<size_t>(output.encoded_size());
  if (buffer_.size() < size) buffer_.resize(size);
  output.Encode(buffer_.data(), static_cast<int>(size));
  writer_.AddMessage(channel, tick.index, {buffer_.data(), size});
}

health_t FinalHealth(const RunSpec& spec, const InlineRunner& runner, int component) {
  const int64_t ticks = runner.ticks_completed();
  health_t health{};
  health.run_id = spec.run_id();
  health.component = spec.graph().component(component).name();
  health.tick = ticks - 1;
  health.utime = ticks > 0 ? MakeTick(ticks - 1, spec.tick_period()).utime : 0;
  health.state = runner.failed() ? health_t::STATE_FAILED : health_t::STATE_FINISHED;
  health.detail = runner.end_detail();
  health.ticks_completed = ticks;
  const LatencyHistogram& latency = runner.latency(component);
  health.latency_median = latency.median();
  health.latency_p99 = latency.p99();
  health.latency_max = latency.max();
  std::ranges::copy(latency.HalfOctaves(), health.latency_count);
  return health;
}

void InlineRecorder::Close(const RunSpec& spec, const std::string& detail) {
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    health_t health = FinalHealth(spec, *runner_, i);
    if (health.detail.empty()) health.detail = detail;
    writer_.AddHealth(HealthChannel(health.component), MessageBytes(health));
  }
  writer_.Close();
}

}  // namespace poise::logging
