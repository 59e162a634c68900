// The robots' messages, by short names, and what can go wrong with them.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include "hw_bridge/unitree/unitree_api.h"
#include "hw_bridge/unitree/unitree_hg.h"

namespace poise::unitree {

using MotorCmd = unitree_hg_msg_dds__MotorCmd_;
using LowCmd = unitree_hg_msg_dds__LowCmd_;
using ImuState = unitree_hg_msg_dds__IMUState_;
using MotorState = unitree_hg_msg_dds__MotorState_;
using LowState = unitree_hg_msg_dds__LowState_;
using Request = unitree_api_msg_dds__Request_;
using Response = unitree_api_msg_dds__Response_;

inline constexpr const char* kCommandTopic = "rt/lowcmd";
inline constexpr const char* kStateTopic = "rt/lowstate";
inline constexpr const char* kTorsoImuTopic = "rt/secondary_imu";
inline constexpr const char* kSwitcherRequestTopic = "rt/api/motion_switcher/request";
inline constexpr const char* kSwitcherResponseTopic = "rt/api/motion_switcher/response";

inline constexpr size_t kNumSlots = 35;
inline constexpr uint8_t kMotorEnabled = 1;  ///< of MotorCmd's and MotorState's mode

/// Says what is wrong and what to do.
class UnitreeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  template <class Arg, class... Args>
  explicit UnitreeError(fmt::format_string<Arg, Args...> text, Arg&& arg, Args&&... args)
      : std::runtime_error(fmt::format(text, std::forward<Arg>(arg), std::forward<Args>(args)...)) {
  }
};

}  // namespace poise::unitree
