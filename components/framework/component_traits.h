// What a component declares of itself, so that nothing else need know it by its name. Fields are
// named by their paths in a scenario, settings as --set takes them ("sim.joint_friction=false").
#pragma once

#include <string>
#include <vector>

namespace poise {

/// Something of the robot or its controller that a run can do without: --without NAME.
struct RemovablePart {
  std::string name;
  std::string field;  ///< true or false; --without sets it to false
};

/// A setting for a scenario that does not have the field `unless`.
struct DefaultSetting {
  std::string unless;
  std::string set;
};

/// An end of what passes between a bridge and servo drives, which no channel carries. Empty: this
/// end has no such field.
struct DriveLink {
  std::string group = {};           ///< in use where a scenario has it
  bool drives = false;              ///< the drives' end; else the master's
  std::string link = {};            ///< group with `udp` (and its port) and `interface`
  std::string simulated_time = {};  ///< true or false
  std::string profile = {};         ///< group: the type of drives
  std::string capture = {};         ///< file that takes all frames
  std::string tag = {};             ///< text that keeps emulated ends of other runs apart
};

struct ComponentTraits {
  /// The scenario's fields that hold its configuration; empty: the one named as its type. Of one
  /// field the message is the configuration; of several, the configuration is a message with fields
  /// of the same names.
  std::vector<std::string> sections = {};
  /// A simulated robot's physics engine, as the scenario's `engine` calls it. Types with an engine
  /// take each other's place in a graph.
  std::string engine = {};
  std::vector<RemovablePart> parts = {};
  /// Settings without what is imperfect about the robot: --ideal.
  std::vector<std::string> ideal = {};
  /// What is set in a run in real time, where a message may be late.
  std::vector<DefaultSetting> realtime = {};
  /// Settings of a run in lockstep beside one in real time, which take back what the latter was
  /// given.
  std::vector<std::string> lockstep = {};
  std::vector<DriveLink> drive_links = {};
};

}  // namespace poise
