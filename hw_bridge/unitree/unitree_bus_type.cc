#include "hw_bridge/unitree/unitree_bus_type.h"

#include "hw_bridge/unitree/dds_link.h"

namespace poise::unitree {

DriveBusType UnitreeBusType() {
  return UnitreeBusType([](const DdsLink& link) { return std::make_unique<DdsRobotLink>(link); });
}

DriveBusType UnitreeBusType(RobotLinkOpener open_link) {
  const auto make = [open_link = std::move(open_link)](const UnitreeBusConfig& config,
                                                       const robot::RobotModel& model,
                                                       double period) {
    return std::make_unique<UnitreeDriveBus>(open_link, config, model, period);
  };
  return {.name = "unitree",
          .config = UnitreeBusConfig::descriptor(),
          .make = MakerOf<UnitreeBusConfig>(make),
          .all_sensors = "follow_robot",
          .link = {.simulated_time = "simulated_time", .tag = "link.tag"}};
}

}  // namespace poise::unitree
