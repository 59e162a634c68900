// What `NAME --describe` says of ports is what the component has, in each configuration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <set>

#include "components/framework/component_description.h"
#include "components/framework/graph.h"
#include "components/framework/optional_ports.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {
namespace {

/// A run in which some ports are there and others not.
struct PortCase {
  std::string scenario, drives, engine;
  std::vector<std::string> set;
};

const std::vector<PortCase>& PortCases() {
  static const std::vector<PortCase> kCases = {
      {"stand", "", "", {}},
      {"stand", "", "mujoco", {}},
      {"walk", "", "", {}},
      {"walk", "", "", {"step_planner.walk.stride_port=true"}},
      {"stand", "", "", {"step_planner.recovery.enabled=true"}},
      {"stand", "ethercat", "", {}},
      {"stand", "unitree", "", {}},
      // A real robot's states bring what is sensed.
      {"stand", "unitree", "", {"hw_bridge.unitree.follow_robot=true"}}};
  return kCases;
}

std::vector<std::string> Strings(const nlohmann::ordered_json& json, const char* key) {
  return json.value(key, std::vector<std::string>());
}

/// "input drive_feedback of drive_feedback_t, same tick", of those that a run of the scenario has.
std::set<std::string> DescribedPorts(const ComponentType& type, const Scenario& scenario) {
  const nlohmann::ordered_json description = DescriptionOf(type);
  std::set<std::string> ports;
  for (const bool input : {true, false}) {
    for (const auto& port : description.at(input ? "inputs" : "outputs")) {
      OptionalPort condition;
      condition.when = Strings(port, "when");
      condition.unless = Strings(port, "unless");
      if (!IsThere(condition, scenario)) continue;
      ports.insert(fmt::format("{} {} of {}{}", input ? "input" : "output",
                               port.at("name").get<std::string>(),
                               port.at("type").get<std::string>(),
                               input ? ", " + port.at("kind").get<std::string>() : ""));
    }
  }
  return ports;
}

std::set<std::string> ConfiguredPorts(const Wiring& wiring) {
  const std::map<InputKind, std::string> kinds = {{InputKind::kSameTick, "same tick"},
                                                  {InputKind::kPreviousTick, "tick before"},
                                                  {InputKind::kLatest, "latest"}};
  std::set<std::string> ports;
  for (const InputPort* const port : wiring.inputs()) {
    ports.insert(
        fmt::format("input {} of {}, {}", port->name(), port->type_name(), kinds.at(port->kind())));
  }
  for (const OutputPort* const port : wiring.outputs()) {
    ports.insert(fmt::format("output {} of {}", port->name(), port->type_name()));
  }
  return ports;
}

TEST(Description, SaysThePortsOfEachConfiguration) {
  std::set<std::string> types;
  std::map<std::string, std::set<bool>> optional;  // whether it was seen there, and not there
  for (const PortCase& each : PortCases()) {
    RunChanges changes;
    changes.drives = each.drives;
    changes.world = each.engine;
    changes.set = each.set;
    const LoadedScenario loaded = LoadScenario(each.scenario, changes);
    const RunSpec spec = MakeRunSpec(loaded, changes);
    SharedObjects shared;
    for (int i = 0; i < spec.graph().component_size(); ++i) {
      const ComponentType& type = *Components().TypeNamed(TypeOf(spec.graph().component(i)));
      const ConfiguredComponent configured = ConfigureComponent(spec, i, type.make, &shared);
      EXPECT_EQ(DescribedPorts(type, loaded.scenario), ConfiguredPorts(configured.wiring))
          << type.name << " of " << each.scenario << ' ' << each.drives;
      types.insert(type.name);
      for (const OptionalPort& port : OptionalPortsOf(type.name)) {
        optional[type.name + "." + port.port].insert(IsThere(port, loaded.scenario));
      }
    }
  }
  for (const auto& [name, entry] : Components().entries()) {
    EXPECT_TRUE(types.contains(name)) << name << ": no case above has it";
  }
  EXPECT_EQ(optional.size(), 4u);
  for (const auto& [port, seen] : optional) EXPECT_EQ(seen, (std::set<bool>{false, true})) << port;
}

TEST(Description, IsWhatEachProgramPrints) {
  for (const auto& [name, type] : Components().entries()) {
    const std::string command = fmt::format("'{}/{}' --describe", POISE_BIN_DIR, name);
    FILE* const pipe = popen(command.c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::string text;
    std::array<char, 4096> part;
    for (size_t n; (n = fread(part.data(), 1, part.size(), pipe)) > 0;) text.append(part.data(), n);
    EXPECT_EQ(pclose(pipe), 0) << command;
    EXPECT_EQ(text, DescriptionOf(type).dump(2) + "\n") << command;
  }
}

}  // namespace
}  // namespace poise
