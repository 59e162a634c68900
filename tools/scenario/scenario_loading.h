// From a scenario's name and the command line to a checked scenario.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/scenario/ablations.h"
#include "tools/scenario/scenario.pb.h"
#include "tools/scenario/scenario_files.h"

namespace poise {

/// What --drives takes.
std::vector<std::string> EmulatedDrives();

/// What the command line changes, in this order: ablations, the variant, single fields.
struct RunChanges {
  std::vector<std::string> without;  ///< of RemovableParts()
  bool ideal = false;
  std::string variant;             ///< of the scenario; empty: none
  bool reference = true;           ///< false: the scenario's reference variant is not run
  std::string world;               ///< the engine; empty: the scenario's or the graph's
  std::string robot;               ///< name, folder or file; empty: the scenario's
  std::vector<std::string> set;    ///< "field.path=value", as SetField takes them, in order
  std::optional<double> duration;  ///< s
  std::optional<uint64_t> seed;
  double drop_rate = 0;
  bool realtime = false;
  std::optional<int> priority;  ///< SCHED_FIFO, in real time; 0: the ordinary scheduler
  std::optional<int> cpu;       ///< that the controller is pinned to in real time
  /// Components that share a process, "PROCESS=A,B,C".
  std::vector<std::string> host;
  bool hosted = false;  ///< those that the graph marks restart: true share the process "controller"
  std::string drives;   ///< of EmulatedDrives(); empty: the simulated robot's own
  std::string link;  ///< of EtherCAT: "udp", or "raw:MASTER,DRIVES" with two interfaces; empty: udp
  std::string capture;  ///< file for all EtherCAT frames; empty: none
  bool operator==(const RunChanges&) const = default;
};

/// A scenario read and resolved to files.
struct LoadedScenario {
  explicit LoadedScenario(const std::filesystem::path& file,
                          const std::filesystem::path& overlay = {})
      : files(file, overlay), scenario(files.Merged()) {}

  ScenarioFiles files;
  /// Merged, with the changes. `reference` is empty when none is to be run.
  Scenario scenario;
  std::vector<FieldChange> changes;  ///< in order
  int variant_index = -1;            ///< place of the chosen variant in the list; -1: none
  std::string graph_file;
  std::string robot_file;

  /// The variant that was chosen, which no change can change; nullptr: none.
  const Variant* variant() const {
    return variant_index < 0 ? nullptr : &scenario.variant(variant_index);
  }
};

/// Reads and checks the scenario itself: bases, variants' names, duration, rate, metrics and limits
/// of its checks, assumptions that name fields. Throws ConfigError, "file:line: field: problem;
/// what to do".
LoadedScenario LoadScenario(const std::string& name, const RunChanges& changes);

/// The scenario's name, or its file's without ending and with _ for what a name cannot have: a part
/// of a path.
std::string NameOf(const LoadedScenario& loaded);

/// The same changes for the scenario's reference variant. Precondition: the scenario has one.
RunChanges ReferenceChanges(const LoadedScenario& loaded, const RunChanges& changes);

/// A line for each flag and the variant: what they changed.
std::string FormatChanges(const Scenario& scenario);
/// A variant, --without, --ideal, --set or --robot made another experiment of it.
bool ChangedByHand(const Scenario& scenario);

/// Throws the ConfigError of a value of the scenario: with file and line of `field`, a path in the
/// merged scenario, or with the flag that changed it.
[[noreturn]] void FailField(const LoadedScenario& loaded, std::string_view field,
                            std::string_view problem);

/// The scenario with its changes as protobuf text.
std::string ScenarioText(const Scenario& scenario);

}  // namespace poise
