// EtherCAT as one of the bridge's drive buses.
#pragma once

#include "hw_bridge/drive/drive_bus_type.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"

namespace poise::ethercat {

/// hw_bridge.ethercat, on sockets.
DriveBusType EthercatBusType();
/// Opens its link by `open_link`, in place of a socket's.
DriveBusType EthercatBusType(LinkOpener open_link);

}  // namespace poise::ethercat
