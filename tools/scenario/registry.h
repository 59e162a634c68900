// All components that this program knows: its own, then those of modules.
#pragma once

#include "components/framework/component_registry.h"

namespace poise {

/// By type, each with its summary. The first call makes added components' configurations fields of
/// Scenario: it comes after LoadModules and before a scenario is read. Throws ConfigError where a
/// name is taken.
const ComponentRegistry& Components();

}  // namespace poise
