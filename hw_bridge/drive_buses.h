// The drive buses that a program knows.
#pragma once

#include <vector>

#include "hw_bridge/drive/drive_bus_type.h"

namespace poise {

/// Makes a bus known, and its group of fields a part of the bridge's configuration; called by a
/// module's POISE_MODULE. Throws ConfigError when there is a field of that name already.
void AddDriveBus(DriveBusType type);

/// Poise's own, then the added ones in the order in which they came.
const std::vector<DriveBusType>& DriveBuses();

}  // namespace poise
