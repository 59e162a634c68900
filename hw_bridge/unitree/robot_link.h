// RobotLink: messages to and from a robot, whatever carries them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hw_bridge/unitree/messages.h"

namespace poise::unitree {

/// States that are kept until they are taken: a cycle brings one, and whatever others send.
inline constexpr int32_t kMostStates = 64;

/// No call but ActiveMode and Release takes longer than its deadline; they block.
class RobotLink {
 public:
  virtual ~RobotLink() = default;
  virtual int64_t Now() const = 0;  ///< ns
  /// False when it could not be handed over.
  virtual bool Send(const LowCmd& command) = 0;
  /// The oldest of the last kMostStates that have come and not been handed out, whole or not; waits
  /// for one until the deadline.
  virtual bool Receive(LowState* state, int64_t deadline) = 0;
  /// The newest reading of the torso's IMU, if one has come.
  virtual bool ReceiveTorsoImu(ImuState* imu) = 0;
  /// The maker's controller that moves the robot; empty: none does; nullopt: no answer by the
  /// deadline.
  virtual std::optional<std::string> ActiveMode(int64_t deadline) = 0;
  /// Whether the robot has taken the request to let go of it.
  virtual bool Release(int64_t deadline) = 0;
};

}  // namespace poise::unitree
