#pragma once

#include "components/framework/component_type.h"

namespace poise {

ComponentType UnitreeEmulatorType();

}  // namespace poise
