#include "logging/events/bridge_words.h"

#include <cmath>

#include "fmt/format.h"
#include "logging/events/code_names.h"

namespace poise::logging {
namespace {

using S = bridge_status_t;

constexpr CodeName kStates[] = {
    {S::STATE_INIT, "init"},         {S::STATE_RUNNING, "running"},
    {S::STATE_DAMPING, "damping"},   {S::STATE_STOPPING, "stopping"},
    {S::STATE_ENABLING, "enabling"}, {S::STATE_HOLDING, "holding"},
    {S::STATE_STOPPED, "stopped"},   {S::STATE_ESTOP, "emergency stop"},
};

constexpr CodeName kReasons[] = {
    {S::REASON_NONE, ""},
    {S::REASON_NO_COMMAND, "no command"},
    {S::REASON_COMMAND_NOT_FINITE, "command not finite, or with a negative stiffness or damping"},
    {S::REASON_COMMAND_STALE, "command stale"},
    {S::REASON_COMMAND_SEQUENCE, "command out of sequence"},
    {S::REASON_COMMAND_SIZE, "command of wrong size"},
    {S::REASON_COMMAND_RUN, "command of another run"},
    {S::REASON_OPERATOR, "operator"},
    {S::REASON_DRIVE_FAULT, "drive fault"},
    {S::REASON_FEEDBACK_NOT_FINITE, "feedback not finite"},
    {S::REASON_DRIVE_NOT_ENABLED, "drive not enabled"},
    {S::REASON_START_POSITION, "joint out of its range at the start"},
    {S::REASON_START_VELOCITY, "joint moving at the start"},
    {S::REASON_JOINT_POSITION, "joint beyond its range"},
    {S::REASON_JOINT_VELOCITY, "joint too fast"},
    {S::REASON_BODY_TILT, "body tilted"},
    {S::REASON_BUS_INPUTS, "inputs of the bus incomplete"},
    {S::REASON_BUS_LINK, "bus link lost"},
    {S::REASON_CYCLE_OVERRUN, "cycle overruns"},
    {S::REASON_ENCODER_FROZEN, "encoder frozen"},
    {S::REASON_ENCODER_JUMP, "encoder jump"},
    {S::REASON_TORQUE_IMPLAUSIBLE, "torque implausible"},
    {S::REASON_DRIVE_STO, "safe torque off"},
    {S::REASON_SIGNAL, "signal"},
    {S::REASON_SHUTDOWN, "shutdown"},
    {S::REASON_REMOTE_STOP, "remote's stop button"},
    {S::REASON_MOTOR_TEMPERATURE, "motor too hot"},
    {S::REASON_SUPPLY_VOLTAGE, "supply voltage too low"},
    {S::REASON_ROBOT_MODE, "robot no longer under low-level commands"},
};

}  // namespace

std::string BridgeStateName(int8_t state) { return NameOf(kStates, state, "state"); }

std::string BridgeReasonName(int8_t reason) { return NameOf(kReasons, reason, "reason"); }

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
