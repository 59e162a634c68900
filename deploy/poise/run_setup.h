// From a scenario's name and the command line to a checked run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/graph.h"
#include "components/framework/graph.pb.h"
#include "deploy/poise/scenario.pb.h"

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
  std::string file;
  std::string source;                ///< text of the file, for the lines of errors
  Scenario scenario;                 ///< with the changes
  std::vector<std::string> changed;  ///< paths of the fields that --set changed
  std::string graph_file;
  std::string robot_file;
};

/// Reads and checks the scenario itself: duration, rate, metrics and limits of its checks,
/// assumptions that name fields. Throws ConfigError, "file:line: field: problem; what to do".
LoadedScenario LoadScenario(const std::string& name, const RunChanges& changes);

/// The scenario with its changes as protobuf text.
std::string ScenarioText(const Scenario& scenario);

/// Builds the run: a random 63-bit run_id, configurations by component, robot and URDF, versions.
/// No ports yet. Throws ConfigError, or RobotError when the robot's files cannot work; what is odd
/// about them goes to `warnings`.
RunSpec MakeRunSpec(const LoadedScenario& loaded, const RunChanges& changes,
                    std::vector<std::string>* warnings);

/// Makes and configures every component, checks the graph and fills in the channels' counts.
/// Throws ConfigError with one line per problem, each with file, line and field.
void CheckRun(const LoadedScenario& loaded, RunSpec* spec);

/// The lines that CheckRun would throw for a graph on its own, without a scenario.
void CheckGraphFile(const std::string& path);

/// A block of free UDP ports for the run's channels. Throws ConfigError when none is found.
void ChoosePorts(RunSpec* spec);

}  // namespace poise
