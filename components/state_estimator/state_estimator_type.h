#pragma once

#include "components/framework/component_type.h"

namespace poise {

ComponentType StateEstimatorType();

}  // namespace poise
