#include "logging/events/bridge_words.h"

#include <cmath>

#include "fmt/format.h"

namespace poise::logging {

std::string BridgeStateName(int8_t state) {
  switch (state) {
    case bridge_status_t::STATE_INIT:
      return "init";
    case bridge_status_t::STATE_RUNNING:
      return "running";
    case bridge_status_t::STATE_DAMPING:
      return "damping";
    case bridge_status_t::STATE_STOPPING:
      return "stopping";
    case bridge_status_t::STATE_ENABLING:
      return "enabling";
    case bridge_status_t::STATE_HOLDING:
      return "holding";
    case bridge_status_t::STATE_STOPPED:
      return "stopped";
    case bridge_status_t::STATE_ESTOP:
      return "emergency stop";
    default:
      return fmt::format("state {}", state);
  }
}

std::string BridgeReasonName(int8_t reason) {
  switch (reason) {
    case bridge_status_t::REASON_NONE:
      return "";
    case bridge_status_t::REASON_NO_COMMAND:
      return "no command";
    case bridge_status_t::REASON_COMMAND_NOT_FINITE:
      return "command not finite, or with a negative stiffness or damping";
    case bridge_status_t::REASON_COMMAND_STALE:
      return "command stale";
    case bridge_status_t::REASON_COMMAND_SEQUENCE:
      return "command out of sequence";
    case bridge_status_t::REASON_COMMAND_SIZE:
      return "command of wrong size";
    case bridge_status_t::REASON_COMMAND_RUN:
      return "command of another run";
    case bridge_status_t::REASON_OPERATOR:
      return "operator";
    case bridge_status_t::REASON_DRIVE_FAULT:
      return "drive fault";
    case bridge_status_t::REASON_FEEDBACK_NOT_FINITE:
      return "feedback not finite";
    case bridge_status_t::REASON_DRIVE_NOT_ENABLED:
      return "drive not enabled";
    case bridge_status_t::REASON_START_POSITION:
      return "joint out of its range at the start";
    case bridge_status_t::REASON_START_VELOCITY:
      return "joint moving at the start";
    case bridge_status_t::REASON_JOINT_POSITION:
      return "joint beyond its range";
    case bridge_status_t::REASON_JOINT_VELOCITY:
      return "joint too fast";
    case bridge_status_t::REASON_BODY_TILT:
      return "body tilted";
    case bridge_status_t::REASON_BUS_INPUTS:
      return "inputs of the bus incomplete";
    case bridge_status_t::REASON_BUS_LINK:
      return "bus link lost";
    case bridge_status_t::REASON_CYCLE_OVERRUN:
      return "cycle overruns";
    case bridge_status_t::REASON_ENCODER_FROZEN:
      return "encoder frozen";
    case bridge_status_t::REASON_ENCODER_JUMP:
      return "encoder jump";
    case bridge_status_t::REASON_TORQUE_IMPLAUSIBLE:
      return "torque implausible";
    case bridge_status_t::REASON_DRIVE_STO:
      return "safe torque off";
    case bridge_status_t::REASON_SIGNAL:
      return "signal";
    case bridge_status_t::REASON_SHUTDOWN:
      return "shutdown";
    case bridge_status_t::REASON_REMOTE_STOP:
      return "remote's stop button";
    case bridge_status_t::REASON_MOTOR_TEMPERATURE:
      return "motor too hot";
    case bridge_status_t::REASON_SUPPLY_VOLTAGE:
      return "supply voltage too low";
    case bridge_status_t::REASON_ROBOT_MODE:
      return "robot no longer under low-level commands";
    default:
      return fmt::format("reason {}", reason);
  }
}

std::string BridgeReasonText(const bridge_status_t& bridge, const ElementNames& names) {
  const std::string reason = BridgeReasonName(bridge.reason);
  if (reason.empty() || bridge.reason_joint < 0) return reason;
  return fmt::format("{} ({})", reason, names.Joint(bridge.reason_joint));
}

std::string ImpedanceCut::Text() const {
  return fmt::format("{} cut from {:.4g} to {:.4g} {}", what, from, to, unit);
}

ImpedanceCut CutOf(const joint_command_t& wanted, const drive_command_t& given, size_t joint) {
  ImpedanceCut most;
  const auto compare = [&](double from, double to, double of, const char* what, const char* unit) {
    const double share = of > 0 ? std::abs(from - to) / of : 0;
    if (share > most.share) most = {share, from, to, what, unit};
  };
  const auto own = [&](const auto& from, const auto& to, const char* what, const char* unit) {
    if (joint >= from.size() || joint >= to.size()) return;
    compare(from[joint], to[joint], std::abs(from[joint]), what, unit);
  };
  own(wanted.stiffness, given.stiffness, "stiffness", "N·m/rad");
  own(wanted.damping, given.damping, "damping", "N·m·s/rad");
  own(wanted.velocity, given.velocity, "velocity", "rad/s");
  if (joint < wanted.position.size() && joint < given.position.size()) {
    compare(wanted.position[joint], given.position[joint], 1, "position", "rad");
  }
  return most;
}

}  // namespace poise::logging
