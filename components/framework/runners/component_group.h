// The components that one process runs, as one: in most processes there is a single one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/framework/graph.h"

namespace poise {

/// Configures the components of a process and calls them together. They share their objects
/// (SharedObjects), which are then computed once.
class ComponentGroup {
 public:
  /// Throws GraphError or ConfigError: also when the run's graph has no process of this name.
  ComponentGroup(const RunSpec& spec, std::string_view process, const ComponentRegistry& registry);

  /// In the graph's order; one at least.
  std::vector<ConfiguredComponent>& components() { return components_; }
  bool Has(int index) const;

  /// Starts hardware. Throws std::runtime_error.
  void Open();
  /// How many have been opened; the next one threw.
  size_t opened() const { return opened_; }
  void Idle();
  /// Closes those that were opened, all of them. Empty: done; else what went wrong.
  std::string Close();
  std::vector<Device*> devices() const;
  /// See Component::cycle_correction. Those that share a process do not own the clock.
  int64_t cycle_correction() const;

  /// All states, one after the other. False: one of them cannot be taken over.
  bool Archive(StateArchive* archive);
  /// The first that wants the run to end, nullptr when none does.
  const ConfiguredComponent* finished() const;

 private:
  SharedObjects shared_;
  std::vector<ConfiguredComponent> components_;
  size_t opened_ = 0;
};

}  // namespace poise
