#include "hw_bridge/command_gate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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
  if (command.num_joints != num_joints_) return Refusal::kSize;
  for (const std::vector<double>* values : {&command.torque, &command.position, &command.velocity,
                                            &command.stiffness, &command.damping}) {
    if (values->size() != static_cast<size_t>(num_joints_)) return Refusal::kSize;
  }
  if (command.tick <= last_tick_ || command.tick > cycle || command.utime < last_utime_) {
    return Refusal::kSequence;
  }
  // With this status the tick is fresh but the torque is not: the controller has none.
  if (command.status == joint_command_t::STATUS_INVALID_INPUT) return Refusal::kStale;
  if (cycle - command.tick > max_age_) return Refusal::kStale;
  const auto finite = [](const std::vector<double>& values, double least) {
    return std::all_of(values.begin(), values.end(),
                       [least](double x) { return std::isfinite(x) && x >= least; });
  };
  constexpr double kAny = std::numeric_limits<double>::lowest();
  const bool fit = finite(command.torque, kAny) && finite(command.position, kAny) &&
                   finite(command.velocity, kAny) && finite(command.stiffness, 0) &&
                   finite(command.damping, 0);
  return fit ? Refusal::kNone : Refusal::kNotFinite;
}

}  // namespace poise
