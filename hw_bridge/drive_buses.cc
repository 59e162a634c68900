#include "hw_bridge/drive_buses.h"

#include <algorithm>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/config_error.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "hw_bridge/unitree/unitree_drive_bus.h"

namespace poise {
namespace {

std::vector<DriveBusType>& Known() {
  static std::vector<DriveBusType> known = {ethercat::EthercatBusType(), unitree::UnitreeBusType()};
  return known;
}

}  // namespace

void AddDriveBus(DriveBusType type) {
  const auto same = [&](const DriveBusType& other) { return other.name == type.name; };
  if (std::ranges::any_of(Known(), same)) {
    throw ConfigError("drive bus " + type.name + " is there twice");
  }
  AddField(*HwBridgeConfig::descriptor(), type.name, *type.config);
  Known().push_back(std::move(type));
}

const std::vector<DriveBusType>& DriveBuses() { return Known(); }

}  // namespace poise
