// The bridge's states and reasons, for people.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "logging/element_names.h"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/joint_command_t.hpp"

namespace poise::logging {

/// The bridge's states and reasons (bridge_status_t) in words: "damping", "no command"; an empty
/// reason for none.
std::string BridgeStateName(int8_t state);
std::string BridgeReasonName(int8_t reason);
/// With the joint that it is about: "joint too fast (right_knee_pitch)".
std::string BridgeReasonText(const bridge_status_t& bridge, const ElementNames& names);

/// What the bridge changed most in the impedance that a command wants of a joint.
struct ImpedanceCut {
  double share = 0;  ///< of what was wanted; of a position, of a radian
  double from = 0, to = 0;
  const char *what = "", *unit = "";

  /// False: so little that it is rounding.
  bool counts() const { return share >= 0.01; }
  /// "stiffness cut from 900 to 600 N·m/rad".
  std::string Text() const;
};
ImpedanceCut CutOf(const joint_command_t& wanted, const drive_command_t& given, size_t joint);

}  // namespace poise::logging
