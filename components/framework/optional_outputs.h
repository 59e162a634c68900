// Outputs that a component has in some runs only.
#pragma once

#include <string>
#include <vector>

namespace poise {

/// An output of components of a type, there where one of these settings of the scenario is true
/// ("step_planner.walk.enabled"). Such a run has a channel for it, in capitals its name.
struct OptionalOutput {
  std::string component;  ///< its type's name
  std::string port;
  std::string type;  ///< of its messages, as MessageType::name
  std::vector<std::string> when;
};

/// Makes one known, once: NAME_type's function says so beside the ports that its type always has.
void AddOptionalOutput(const OptionalOutput& output);

/// Those of a component's type.
std::vector<OptionalOutput> OptionalOutputsOf(const std::string& component);

}  // namespace poise
