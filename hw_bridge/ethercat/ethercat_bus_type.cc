#include "hw_bridge/ethercat/ethercat_bus_type.h"

#include <fmt/format.h>

#include <cmath>

#include "components/framework/configuration/config_error.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/ethercat/links/socket_link.h"

namespace poise::ethercat {
DriveBusType EthercatBusType() {
  return EthercatBusType(
      [](const LinkConfig& config) { return OpenLink(config, SocketLink::Side::kMaster); });
}

DriveBusType EthercatBusType(LinkOpener open_link) {
  const auto make = [open_link = std::move(open_link)](
                        EthercatBusConfig config, const robot::RobotModel& model, double period) {
    const auto cycle = static_cast<uint32_t>(std::llround(period * 1e9));
    if (config.master().has_cycle() && config.master().cycle() != cycle) {
      throw ConfigError("master.cycle",
                        fmt::format("must be the run's period, {} ns, or be left out", cycle));
    }
    config.mutable_master()->set_cycle(cycle);
    return std::make_unique<EthercatDriveBus>(open_link, config, model);
  };
  return {.name = "ethercat",
          .config = EthercatBusConfig::descriptor(),
          .make = MakerOf<EthercatBusConfig>(make),
          .link = {.link = "link",
                   .simulated_time = "simulated_time",
                   .profile = "master.profile",
                   .capture = "capture"}};
}

}  // namespace poise::ethercat
