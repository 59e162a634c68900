// From a scenario's name and the command line to a checked scenario.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "deploy/poise/scenario.pb.h"
#include "deploy/poise/scenario_files.h"

namespace poise {

/// What the command line changes.
struct RunChanges {
  std::vector<std::string> set;    ///< "field.path=value", as SetField takes them, in order
  std::optional<double> duration;  ///< s
  std::optional<uint64_t> seed;
  double drop_rate = 0;
  bool realtime = false;
};

/// A scenario read and resolved to files.
struct LoadedScenario {
  explicit LoadedScenario(const std::filesystem::path& file)
      : files(file), scenario(files.Merged()) {}

  ScenarioFiles files;
  Scenario scenario;                 ///< merged, with the changes
  std::vector<std::string> changed;  ///< paths of the fields that --set changed
  std::string graph_file;
  std::string robot_file;
};

/// Reads and checks the scenario itself: bases, duration, rate, metrics and limits of its checks,
/// assumptions that name fields. Throws ConfigError, "file:line: field: problem; what to do".
LoadedScenario LoadScenario(const std::string& name, const RunChanges& changes);

/// Throws the ConfigError of a value of the scenario: with file and line of `field`, a path in the
/// merged scenario, or with the flag that changed it.
[[noreturn]] void FailField(const LoadedScenario& loaded, std::string_view field,
                            std::string_view problem);

/// The scenario with its changes as protobuf text.
std::string ScenarioText(const Scenario& scenario);

}  // namespace poise
