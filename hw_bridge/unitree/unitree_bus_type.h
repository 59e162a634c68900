// A Unitree robot as one of the bridge's drive buses.
#pragma once

#include "hw_bridge/drive/drive_bus_type.h"
#include "hw_bridge/unitree/unitree_drive_bus.h"

namespace poise::unitree {

/// hw_bridge.unitree, on DDS.
DriveBusType UnitreeBusType();
/// Opens its link by `open_link`, in place of DDS.
DriveBusType UnitreeBusType(RobotLinkOpener open_link);

}  // namespace poise::unitree
