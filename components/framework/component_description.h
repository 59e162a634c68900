// What a component says of itself: NAME --describe, poise list components NAME.
#pragma once

#include <nlohmann/json.hpp>

#include "components/framework/component_type.h"

namespace poise {

/// name, summary, inputs and outputs (name, type, of an input kind), settings (path, type, default,
/// unit, meaning, values), parts that --without takes away, and the engine of a simulated robot.
nlohmann::ordered_json DescriptionOf(const ComponentType& type);

}  // namespace poise
