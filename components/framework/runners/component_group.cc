#include "components/framework/runners/component_group.h"

#include <algorithm>

#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {

ComponentGroup::ComponentGroup(const RunSpec& spec, std::string_view process,
                               const ComponentRegistry& registry) {
  CheckRun(spec);
  const Graph& graph = spec.graph();
  const std::vector<int> members = ComponentsOf(graph, process);
  if (members.empty()) {
    throw ConfigError(fmt::format("graph {}: has no process '{}'; it has {}", graph.name(), process,
                                  fmt::join(ProcessNames(graph), ", ")));
  }
  for (const int member : members) {
    const std::string& type = TypeOf(graph.component(member));
    const ComponentFactory* factory = registry.Find(type);
    if (factory == nullptr) {
      throw ConfigError(fmt::format(
          "component {}: this program does not have its type {}, which process {} must run",
          graph.component(member).name(), type, process));
    }
    components_.push_back(ConfigureComponent(spec, member, *factory, &shared_));
    CheckWiring(graph, member, components_.back().wiring);
  }
}

bool ComponentGroup::Has(int index) const {
  return std::ranges::any_of(components_, [&](const auto& c) { return c.index == index; });
}

void ComponentGroup::Open() {
  for (const ConfiguredComponent& each : components_) {
    each.component->Open();
    ++opened_;
  }
}

void ComponentGroup::Idle() {
  for (size_t i = 0; i < opened_; ++i) components_[i].component->Idle();
}

std::string ComponentGroup::Close() {
  std::string problems;
  for (size_t i = 0; i < opened_; ++i) {
    const std::string problem = components_[i].component->Close();
    if (!problem.empty()) problems += (problems.empty() ? "" : "; ") + problem;
  }
  opened_ = 0;
  return problems;
}

std::vector<Device*> ComponentGroup::devices() const {
  std::vector<Device*> devices;
  for (const ConfiguredComponent& each : components_) {
    const std::vector<Device*> own = each.component->devices();
    devices.insert(devices.end(), own.begin(), own.end());
  }
  return devices;
}

int64_t ComponentGroup::cycle_correction() const {
  return components_.front().component->cycle_correction();
}

bool ComponentGroup::Archive(StateArchive* archive) {
  return std::ranges::all_of(components_, [&](const ConfiguredComponent& each) {
    return each.component->Archive(archive);
  });
}

const ConfiguredComponent* ComponentGroup::finished() const {
  const auto first = std::ranges::find_if(components_, [](const ConfiguredComponent& each) {
    return !each.component->finished().empty();
  });
  return first == components_.end() ? nullptr : &*first;
}

}  // namespace poise
