// From a scenario to a checked run, in one direction: LoadScenario reads the files and changes the
// scenario as a message, MakeRunSpec writes of it the text that each component reads, and
// ConfigureRun has each read it; who runs inside this process runs these components. Only what a
// log holds is text to begin with (ChangeConfigurations).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.h"
#include "components/framework/graph.pb.h"
#include "components/framework/optional_ports.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {

/// Builds the run: a random 63-bit run_id, configurations by component, robot and URDF, versions.
/// No ports yet. Throws ConfigError, also for a change of another engine's field, or RobotError
/// when the robot's files cannot be read.
RunSpec MakeRunSpec(const LoadedScenario& loaded, const RunChanges& changes);

/// The engine that a scenario's field is for, "mujoco" of "mujoco.contact_softness=1e-6"; empty: it
/// is for none alone.
std::string EngineOfField(const std::string& field);

/// Makes and configures every component, checks the graph and fills in the channels' counts.
/// Throws ConfigError with one line per problem, each with file, line and field, or RobotError when
/// the robot's files cannot work.
BoundGraph ConfigureRun(const LoadedScenario& loaded, RunSpec* spec);

/// What the components say is odd about their configurations (Wiring::AddWarning), by the
/// scenario's fields.
std::vector<std::string> WarningsOf(const RunSpec& spec, const BoundGraph& graph);

/// A run that is checked and has not begun.
struct RunSetup {
  LoadedScenario loaded;
  RunSpec spec;
  std::optional<BoundGraph> graph;    ///< its components, for who runs them inside this process
  std::vector<std::string> warnings;  ///< those of WarningsOf
};

/// The whole way. Throws as LoadScenario, MakeRunSpec and ConfigureRun do.
RunSetup SetUpRun(const std::string& scenario, const RunChanges& changes);

/// The lines that ConfigureRun would throw for a graph on its own, without a scenario.
void CheckGraphFile(const std::string& path);

/// Whether a run of the scenario has the port.
bool IsThere(const OptionalPort& port, const Scenario& scenario);

/// Changes fields of the components' configurations in a run, "task_controller.com.kp=200", in
/// order. Throws ConfigError.
void ChangeConfigurations(const std::vector<std::string>& changes, RunSpec* spec);

/// Why a log's component cannot do its work again; empty: it can.
std::string WhyNotReplayed(const RunSpec& spec, int component);

/// A block of free UDP ports for the channels of the scenario's run, and its source port taken. The
/// ends of drives are configured anew, apart from those of other runs. Throws ConfigError when none
/// is found; BusError when multicast is not routed.
RunSource ChoosePorts(const Scenario& scenario, RunSpec* spec);

}  // namespace poise
