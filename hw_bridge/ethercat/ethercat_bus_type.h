// EtherCAT as one of the bridge's drive buses.
#pragma once

#include <functional>
#include <memory>

#include "hw_bridge/drive/drive_bus_type.h"
#include "hw_bridge/ethercat/links/socket_link.h"

namespace poise::ethercat {

/// Opens the configured link. Throws EthercatError.
using LinkOpener = std::function<std::unique_ptr<Link>(const LinkConfig& config)>;

/// hw_bridge.ethercat; its Start opens the link.
DriveBusType EthercatBusType(LinkOpener open_link = OpenLink);

}  // namespace poise::ethercat
