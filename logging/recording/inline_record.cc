#include "logging/recording/inline_record.h"

#include <algorithm>
#include <map>
#include <utility>

#include "components/robot_files/robot_files.h"
#include "logging/recording/inline_recorder.h"

namespace poise::logging {

InlineRecord::InlineRecord(const RunSpec& spec, const std::string& scenario, InlineRunner* runner)
    : runner_(runner) {
  run_.info = MakeRunInfo(spec, scenario);
  run_.spec = spec;
  run_.robot = robot::LoadRobotTexts(run_.info.robot, run_.info.urdf);
  std::map<std::string, Keep, std::less<>> keep;
  run_.VisitSeries([&]<class T>(Series<T>* series) {
    keep.emplace(T::getTypeName(), [series](int64_t tick, const void* message) {
      series->Set(tick, *static_cast<const T*>(message));
    });
  });
  for (const Channel& channel : spec.graph().channel()) {
    auto of_type = keep.extract(channel.type());  // the graph's first of a type
    keep_.push_back(of_type && !channel.external() ? std::move(of_type.mapped()) : nullptr);
  }
  messages_.resize(keep_.size());
  runner->set_tap([this](int channel, const OutputPort& output, const Tick& tick) {
    const auto c = static_cast<size_t>(channel);
    ++messages_[c];
    if (keep_[c]) keep_[c](tick.index, output.message());
  });
}

RunRecord InlineRecord::Take() {
  runner_->set_tap({});
  const Graph& graph = run_.spec.graph();
  for (const int64_t messages : messages_) run_.num_ticks = std::max(run_.num_ticks, messages);
  for (int c = 0; c < graph.channel_size(); ++c) {
    if (graph.channel(c).external()) continue;
    ChannelCompleteness completeness;
    completeness.name = graph.channel(c).name();
    completeness.messages = messages_[static_cast<size_t>(c)];
    completeness.missing = run_.num_ticks - completeness.messages;
    run_.channels.push_back(std::move(completeness));
  }
  for (int i = 0; i < graph.component_size(); ++i) {
    health_t health = FinalHealth(run_.spec, *runner_, i);
    health.latency_median = health.latency_p99 = health.latency_max = 0;
    run_.health[health.component] = std::move(health);
  }
  return std::move(run_);
}

}  // namespace poise::logging
