// What a component is, without its class.
#pragma once

#include <string>

#include "components/framework/component.h"
#include "components/framework/component_traits.h"

namespace poise {

/// Each component's folder has a header NAME_type.h with a function that gives its own: programs
/// and the registry need no more of it, and compile without its class.
struct ComponentType {
  std::string name;     ///< of the type and of its program
  std::string summary;  ///< a line for `poise list components`
  ComponentFactory make;
  ComponentTraits traits = {};
};

}  // namespace poise
