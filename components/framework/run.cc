#include "components/framework/run.h"

#include <algorithm>
#include <cctype>

#include "fmt/format.h"

namespace poise {
namespace {

std::string Url(const RunSpec& spec, int offset) {
  return fmt::format("udpm://{}:{}?ttl={}", spec.multicast_group(), spec.first_port() + offset,
                     spec.ttl());
}

/// reach[a][b]: a channel path leads from component a to component b.
std::vector<std::vector<bool>> Reachability(const Graph& graph) {
  const auto n = static_cast<size_t>(graph.component_size());
  std::vector<std::vector<bool>> reach(n, std::vector<bool>(n, false));
  for (size_t a = 0; a < n; ++a) {
    for (const Connection& output : graph.component(static_cast<int>(a)).output()) {
      for (size_t b = 0; b < n; ++b) {
        for (const Connection& input : graph.component(static_cast<int>(b)).input()) {
          if (input.channel() == output.channel()) reach[a][b] = true;
        }
      }
    }
  }
  for (size_t k = 0; k < n; ++k) {
    for (size_t a = 0; a < n; ++a) {
      for (size_t b = 0; b < n; ++b) {
        if (reach[a][k] && reach[k][b]) reach[a][b] = true;
      }
    }
  }
  return reach;
}

}  // namespace

uint64_t InstanceSeed(uint64_t seed, std::string_view name) {
  uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  uint64_t x = hash + seed * 0x9e3779b97f4a7c15u;  // SplitMix64
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

const std::string& TypeOf(const ComponentInstance& instance) {
  return instance.has_type() ? instance.type() : instance.name();
}

const Resource& ResourceOf(const RunSpec& spec, std::string_view name) {
  const auto found = std::ranges::find(spec.resource(), name, &Resource::name);
  return found == spec.resource().end() ? Resource::default_instance() : *found;
}

const std::string& ProcessOf(const ComponentInstance& instance) {
  return instance.has_process() ? instance.process() : instance.name();
}

std::vector<std::string> ProcessNames(const Graph& graph) {
  std::vector<std::string> names;
  for (const ComponentInstance& instance : graph.component()) {
    const std::string& name = ProcessOf(instance);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

std::vector<int> ComponentsOf(const Graph& graph, std::string_view process) {
  std::vector<int> components;
  for (int i = 0; i < graph.component_size(); ++i) {
    if (ProcessOf(graph.component(i)) == process) components.push_back(i);
  }
  return components;
}

std::string ServiceUrl(const RunSpec& spec) { return Url(spec, 0); }
std::string MirrorUrl(const RunSpec& spec) { return Url(spec, 1); }
std::string ChannelUrl(const RunSpec& spec, int i) { return Url(spec, 2 + i); }

std::string HealthChannel(std::string_view component) {
  std::string channel = "HEALTH_";
  for (const char c : component) {
    channel += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return channel;
}

std::vector<int> ProgressReporters(const Graph& graph, int source) {
  const auto reach = Reachability(graph);
  std::vector<int> reporters;
  const auto s = static_cast<size_t>(source);
  for (size_t i = 0; i < reach.size(); ++i) {
    if (i != s && reach[s][i] && !reach[i][s]) reporters.push_back(static_cast<int>(i));
  }
  return reporters;
}

bool MustReportProgress(const Graph& graph, int component) {
  const auto reach = Reachability(graph);
  const auto c = static_cast<size_t>(component);
  for (size_t i = 0; i < reach.size(); ++i) {
    if (i != c && reach[i][c] && !reach[c][i]) return true;
  }
  return false;
}

}  // namespace poise
