// Ports that a component has in some runs only.
#pragma once

#include <string>
#include <vector>

#include "components/framework/component.h"

namespace poise {

/// A port of components of a type, there where one of the settings `when` of the scenario is true
/// or, of a group, is set ("step_planner.walk.enabled", "hw_bridge.ethercat"), and none of `unless`
/// is.
struct OptionalPort {
  std::string component;  ///< its type's name
  std::string port;
  std::string type;                    ///< of its messages, as MessageType::name
  std::vector<std::string> when = {};  ///< none: in every run but for `unless`
  std::vector<std::string> unless = {};
  bool input = false;
  InputKind kind = InputKind::kSameTick;  ///< of an input
  /// The run gives an output a channel, in capitals its name, where it is there, and takes it away
  /// where it is not. false: the graph says.
  bool brings_channel = false;
};

/// Makes one known, once: the function that gives the type says so beside the ports that its type
/// always has.
void AddOptionalPort(const OptionalPort& port);

std::vector<OptionalPort> OptionalPortsOf(const std::string& component);

/// "where hw_bridge.ethercat or hw_bridge.unitree is set", for a person.
std::string WhereText(const OptionalPort& port);

}  // namespace poise
