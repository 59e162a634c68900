#include "hw_bridge/command_gate.h"

#include <algorithm>
#include <cmath>

namespace poise {

Refusal CommandGate::Check(const joint_command_t& command, int64_t cycle) {
  const Refusal refusal = Find(command, cycle);
  if (refusal == Refusal::kNone) {
    last_tick_ = command.tick;
    last_utime_ = command.utime;
  } else {
    ++refused_[static_cast<size_t>(refusal)];
  }
  return refusal;
}

Refusal CommandGate::Find(const joint_command_t& command, int64_t cycle) const {
  if (command.run_id != run_id_) return Refusal::kRun;
  if (command.num_joints != num_joints_ ||
      command.torque.size() != static_cast<size_t>(num_joints_)) {
    return Refusal::kSize;
  }
  if (command.tick <= last_tick_ || command.tick > cycle || command.utime < last_utime_) {
    return Refusal::kSequence;
  }
  // With this status the tick is fresh but the torque is not: the controller has none.
  if (command.status == joint_command_t::STATUS_INVALID_INPUT) return Refusal::kStale;
  if (cycle - command.tick > max_age_) return Refusal::kStale;
  const bool finite = std::all_of(command.torque.begin(), command.torque.end(),
                                  [](double torque) { return std::isfinite(torque); });
  return finite ? Refusal::kNone : Refusal::kNotFinite;
}

}  // namespace poise
