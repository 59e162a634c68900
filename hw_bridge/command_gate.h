// CommandGate: which joint commands are fit to reach the motors, and why the others are not.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "poise/joint_command_t.hpp"

namespace poise {

enum class Refusal {
  kNone,
  kRun,        ///< of another run
  kSize,       ///< not one torque, position, velocity, stiffness and damping per joint
  kSequence,   ///< not after the last accepted command, or for a cycle yet to come
  kStale,      ///< older than the allowed number of cycles, or one sent again for want of a new one
  kNotFinite,  ///< one of them is NaN or infinite, or a stiffness or damping is negative
};
inline constexpr int kNumRefusals = 6;

/// Checks in the order of Refusal, counts the first that fails. Never allocates after construction.
class CommandGate {
 public:
  /// `max_age`: cycles a command may lag behind the cycle it arrives in.
  CommandGate(int num_joints, int max_age) : num_joints_(num_joints), max_age_(max_age) {}

  void set_run(int64_t run_id) { run_id_ = run_id; }

  /// kNone: accepted, and its tick becomes the last accepted. `cycle` ≥ 0: the current cycle.
  Refusal Check(const joint_command_t& command, int64_t cycle);

  bool any_accepted() const { return last_tick_ >= 0; }
  /// Cycles between the last accepted command's tick and `cycle`. Precondition: any_accepted().
  int64_t Age(int64_t cycle) const { return cycle - last_tick_; }
  int64_t refused(Refusal refusal) const { return refused_[static_cast<size_t>(refusal)]; }

 private:
  Refusal Find(const joint_command_t& command, int64_t cycle) const;

  int num_joints_, max_age_;
  int64_t run_id_ = 0;
  int64_t last_tick_ = -1;
  int64_t last_utime_ = std::numeric_limits<int64_t>::min();
  std::array<int64_t, kNumRefusals> refused_{};
};

}  // namespace poise
