// DDS writers of ROS 2's topics.
#pragma once

#include <dds/dds.h>

#include <string>

#include "hw_bridge/unitree/dds.h"

namespace poise {

/// How long a topic's messages are kept for readers that come later.
enum class Keeping {
  kNone,  ///< ROS 2's default: reliable, volatile, the last 10
  kLast,  ///< "transient local", the last one: robot_description, tf_static
  kAll    ///< "transient local", the last 1,000: rosout
};

/// One topic: NAME of ROS 2 is rt/NAME in DDS. A reader that takes nothing holds nobody: beyond its
/// history the oldest messages are gone.
class Ros2Writer {
 public:
  /// Throws unitree::UnitreeError.
  Ros2Writer(const unitree::Participant& participant, const dds_topic_descriptor_t& type,
             const std::string& name, Keeping keeping);
  ~Ros2Writer();
  Ros2Writer(const Ros2Writer&) = delete;
  Ros2Writer& operator=(const Ros2Writer&) = delete;

  /// A message of the type's C struct. False when DDS did not take it.
  bool Write(const void* message);

 private:
  dds_entity_t topic_ = 0, writer_ = 0;
};

}  // namespace poise
