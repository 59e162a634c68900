// What all runners of a run agree on: times of ticks, seeds, ports, channel names.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/component.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// Tick `index` of a run with ticks of `period` seconds, of which `lead` come before the scenario's
/// time 0.
inline Tick MakeTick(int64_t index, double period, int64_t lead = 0) {
  return {index, std::llround(static_cast<double>(index) * period * 1e6),
          static_cast<double>(index - lead) * period};
}

/// The run's seed mixed with a name: components that share a seed do not share their noise.
uint64_t InstanceSeed(uint64_t seed, std::string_view name);

/// Component type of an instance: its type, or its name when it has none.
const std::string& TypeOf(const ComponentInstance& instance);

/// The lengths of a channel's arrays.
inline std::span<const int32_t> CountsOf(const Channel& channel) {
  return {channel.count().data(), static_cast<size_t>(channel.count_size())};
}

/// The run's resource of a name, as "robot"; an empty one where it has none.
const Resource& ResourceOf(const RunSpec& spec, std::string_view name);

/// Process that an instance runs in: its process, or its name when it has none.
const std::string& ProcessOf(const ComponentInstance& instance);
/// Names of the graph's processes, each where its first component stands.
std::vector<std::string> ProcessNames(const Graph& graph);
/// Indexes of the components that run in a process, in the graph's order.
std::vector<int> ComponentsOf(const Graph& graph, std::string_view process);

/// "udpm://GROUP:PORT?ttl=TTL" of the services port (CONTROL, HEALTH_*), the public mirror, channel
/// `i` of the graph.
std::string ServiceUrl(const RunSpec& spec);
std::string MirrorUrl(const RunSpec& spec);
std::string ChannelUrl(const RunSpec& spec, int i);

inline constexpr char kControlChannel[] = "CONTROL";
/// The recorder's place on the service port; no component may have it.
inline constexpr char kRecorderName[] = "recorder";
/// "HEALTH_" + NAME in capitals.
std::string HealthChannel(std::string_view component);

/// Back-pressure. A tick source runs at most kMaxLead ticks ahead of the recorder and of every
/// component from which no channel leads back to it; those report their progress every
/// kProgressInterval ticks (COMMAND_RECORDED).
inline constexpr int64_t kMaxLead = 128;
inline constexpr int64_t kProgressInterval = 16;
/// Messages a writer keeps to answer requests; messages a reader keeps ahead of its tick.
inline constexpr int64_t kSentHistory = 512;
inline constexpr int64_t kReceiveWindow = 256;

/// Indexes of the components that must report progress to component `source` (see kMaxLead).
std::vector<int> ProgressReporters(const Graph& graph, int source);
/// True when `component` reports progress to someone.
bool MustReportProgress(const Graph& graph, int component);

}  // namespace poise
