// The fields of every kind of file that users write.
#pragma once

#include <vector>

#include "components/framework/configuration/field_reference.h"

namespace poise {

enum class Schema { kScenario, kRobot, kSweep, kGraph };

/// All its fields: FieldsOfType. A scenario has the configurations of added components (modules),
/// too.
std::vector<FieldEntry> FieldReference(Schema schema);

}  // namespace poise
