// All components that this build knows.
#pragma once

#include "components/framework/component.h"

namespace poise {

/// By type, each with its summary.
const ComponentRegistry& Components();

}  // namespace poise
