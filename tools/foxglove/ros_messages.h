// Two of ROS 2's messages, as the bytes that its own tools read (CDR) and their definitions.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace poise {

/// Definitions as a .msg file has them, with those they use: the schema "ros2msg" of MCAP.
inline constexpr std::string_view kStringDefinition = "string data\n";
extern const std::string_view kJointStateDefinition;

/// std_msgs/msg/String.
std::string StringCdr(std::string_view text);
/// sensor_msgs/msg/JointState, of as many joints as names: rad, rad/s, N·m; empty where unknown.
std::string JointStateCdr(int64_t utime, std::span<const std::string> names,
                          std::span<const double> position, std::span<const double> velocity,
                          std::span<const double> effort);

}  // namespace poise
