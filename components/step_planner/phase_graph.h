// The phases as a graph: which phase follows which, by the outcome of the one before.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "components/robot/foot.h"
#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// Where a phase stands in the configuration: "phase[1]".
std::string PhaseField(int phase);

/// Feet in contact.
robot::FootArray<bool> ContactsOf(Support support);

/// Which phase follows which, by their index in the configuration. Immutable.
class PhaseGraph {
 public:
  /// Throws ConfigError naming the field ("phase[1].next[0].to"): no phase, a name that no phase
  /// has or two have, an outcome named twice or that cannot come, a phase that is never reached, a
  /// loop of phases that take no time.
  explicit PhaseGraph(const StepPlannerConfig& config);

  static constexpr int kNone = -1;
  int size() const { return static_cast<int>(follower_.size()); }
  /// What follows `phase` after `outcome`; of CONTACT_LOST that of `foot`. kNone: the outcome
  /// changes nothing.
  int Follower(int phase, Outcome outcome, robot::Foot foot = robot::Foot::kRight) const;
  /// An arrow from a phase to another.
  struct Arrow {
    int from, to;
    Outcome outcome;
    robot::Foot foot;  ///< CONTACT_LOST: of this one
    int next;          ///< its index in the phase's `next`; kNone: the phase after it in the list
  };
  const std::vector<Arrow>& arrows() const { return arrows_; }

 private:
  using Followers = std::array<int, 5>;  // DONE, NO_SURFACE, TIMEOUT, CONTACT_LOST by foot

  void AddArrows(const StepPlannerConfig& config, int phase);
  void CheckReached(const StepPlannerConfig& config) const;
  void CheckLoops(const StepPlannerConfig& config) const;

  std::vector<Followers> follower_;
  std::vector<Arrow> arrows_;
};

}  // namespace poise
