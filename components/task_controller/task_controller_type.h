#pragma once

#include "components/framework/component_type.h"

namespace poise {

ComponentType TaskControllerType();

}  // namespace poise
