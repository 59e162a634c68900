#include "tools/scenario/described_components.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "components/framework/component_type.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/framework/say_error.h"
#include "components/messages/foreign_component.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::set<std::string>& Described() {
  static std::set<std::string> names;
  return names;
}

InputKind KindOf(const std::string& kind) {
  if (kind == "same tick") return InputKind::kSameTick;
  if (kind == "tick before") return InputKind::kPreviousTick;
  if (kind == "latest") return InputKind::kLatest;
  throw ConfigError(
      fmt::format("kind '{}' of an input is none of: same tick, tick before, latest", kind));
}

/// How an error names one.
std::string OwnProgram(const ComponentInstance& instance) {
  return fmt::format("component '{}' is {}, a program of its own", instance.name(),
                     TypeOf(instance));
}

/// Throws ConfigError.
ComponentType ReadDescription(const fs::path& file) {
  try {
    const Json json = Json::parse(ReadFile(file.string()));
    std::vector<PortType> ports;
    for (const char* const side : {"inputs", "outputs"}) {
      for (const Json& port : json.value(side, Json::array())) {
        if (!port.contains("when") && !port.contains("unless")) continue;
        throw ConfigError(fmt::format(
            "its port {} is not in every run, which a component of a program of one's own cannot "
            "have; leave \"when\" and \"unless\" out",
            port.value("name", "")));
      }
    }
    for (const Json& port : json.value("inputs", Json::array())) {
      ports.push_back({port.at("name"), port.at("type"), true, KindOf(port.at("kind"))});
    }
    for (const Json& port : json.value("outputs", Json::array())) {
      ports.push_back({port.at("name"), port.at("type"), false, InputKind::kSameTick});
    }
    if (ports.empty()) throw ConfigError("it has neither inputs nor outputs");
    const std::string name = json.at("name");
    if (name != file.stem()) {
      throw ConfigError(
          fmt::format("it describes '{}': the file's name must be {}.json", name, name));
    }
    return ProgramType(name, json.value("summary", ""), std::move(ports));
  } catch (const std::exception& error) {
    throw ConfigError(
        fmt::format("{}: is no description of a component ({}); write it with: "
                    "NAME --describe",
                    file.string(), error.what()));
  }
}

}  // namespace

void LoadDescriptions() {
  static bool done = false;
  if (done) return;
  done = true;
  for (const fs::path& folder : PoisePath()) {
    std::set<fs::path> files;  // in one order everywhere
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder / "lib/poise/components", error)) {
      if (entry.path().extension() == ".json") files.insert(entry.path());
    }
    for (const fs::path& file : files) {
      std::optional<ComponentType> type;
      try {
        type = ReadDescription(file);
      } catch (const ConfigError& broken) {
        // The program that is to write it anew loads all of them, too.
        SayError(fmt::format("{}; the component is left out", broken.what()));
        continue;
      }
      Described().insert(type->name);
      AddComponent(std::move(*type));
    }
  }
}

bool IsDescribed(const std::string& type) { return Described().contains(type); }

std::string OwnProgramOf(const Graph& graph) {
  for (const ComponentInstance& instance : graph.component()) {
    if (IsDescribed(TypeOf(instance))) return OwnProgram(instance);
  }
  return "";
}

void CheckSharedProcesses(const Graph& graph) {
  for (const std::string& process : ProcessNames(graph)) {
    const std::vector<int> components = ComponentsOf(graph, process);
    if (components.size() < 2) continue;
    for (const int i : components) {
      if (!IsDescribed(TypeOf(graph.component(i)))) continue;
      throw ConfigError(fmt::format(
          "{}, which cannot share the process {} with others; leave it out of --host and of the "
          "graph's process: and run without --hosted",
          OwnProgram(graph.component(i)), process));
    }
  }
}

}  // namespace poise
