#include "logging/recording/inline_record.h"

#include <algorithm>
#include <map>
#include <utility>

#include "components/robot_files/robot_files.h"
#include "logging/recording/inline_recorder.h"

namespace poise::logging {

InlineRecord::InlineRecord(const RunSpec& spec, const std::string& scenario, InlineRunner* runner)
    : InlineRecord(spec, MakeRunInfo(spec, scenario), runner) {
  std::ranges::fill(other_, nullptr);
  runner->set_tap([this](int channel, const OutputPort& output, const Tick& tick) {
    Add(channel, output, tick);
  });
}

InlineRecord::InlineRecord(const RunSpec& spec, run_info_t info, const InlineRunner* runner)
    : runner_(runner) {
  run_.info = std::move(info);
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
    const bool typed = of_type && !channel.external();
    keep_.push_back(typed ? std::move(of_type.mapped()) : nullptr);
    other_.push_back(typed || channel.external() ? nullptr : &run_.other[channel.name()]);
  }
  messages_.resize(keep_.size());
}

void InlineRecord::Add(int channel, const OutputPort& output, const Tick& tick) {
  const auto c = static_cast<size_t>(channel);
  ++messages_[c];
  if (keep_[c]) {
    keep_[c](tick.index, output.message());
  } else if (other_[c] != nullptr) {
    std::vector<uint8_t> bytes(static_cast<size_t>(output.encoded_size()));
    output.Encode(bytes.data(), static_cast<int>(bytes.size()));
    other_[c]->Set(tick.index, std::move(bytes));
  }
}

RunRecord InlineRecord::Take(bool latencies) {
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
    if (!latencies) health.latency_median = health.latency_p99 = health.latency_max = 0;
    run_.health[health.component] = std::move(health);
  }
  return std::move(run_);
}

}  // namespace poise::logging
