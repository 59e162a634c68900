// What a drive bus is, without its class.
#pragma once

#include <google/protobuf/message.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "components/framework/component_traits.h"
#include "components/robot/robot_model.h"
#include "hw_bridge/drive/drive_bus.h"

namespace poise {

/// A bus that the bridge has where its configuration holds a group of fields of the bus's name.
struct DriveBusType {
  /// The bus, before its Start. `group`: a message of the type below; `period`, s, of a cycle.
  /// Throws std::runtime_error for a configuration that it cannot work with, or ConfigError with
  /// the path of the field in the group.
  using Maker = std::function<std::unique_ptr<DriveBus>(
      const google::protobuf::Message& group, const robot::RobotModel& model, double period)>;

  std::string name;                                      ///< "ethercat" of hw_bridge.ethercat
  const google::protobuf::Descriptor* config = nullptr;  ///< the group's type
  Maker make;
  /// Setting of the group, true or false: the bus reads all sensors, and the bridge has no input
  /// drive_feedback. Empty: the bridge has it.
  std::string all_sensors = {};
  /// What of the group anything else must know, by paths in the group.
  DriveLink link = {};
  /// The schema that has the group, as ComponentType has its own; nullptr: it is the bridge's.
  std::string_view (*schema)() = nullptr;
};

/// `make` of a bus whose group is a `Config`; Make(const Config&, const robot::RobotModel&, period)
/// returns a pointer to the bus.
template <class Config, class Make>
DriveBusType::Maker MakerOf(Make make) {
  return [make = std::move(make)](const google::protobuf::Message& group,
                                  const robot::RobotModel& model,
                                  double period) -> std::unique_ptr<DriveBus> {
    return make(dynamic_cast<const Config&>(group), model, period);
  };
}

}  // namespace poise
