// A foot that was to carry and carries nothing.
#pragma once

#include "components/framework/state_archive.h"
#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// Lost once a foot that is to carry has measured less than release_load for lost_duration; no
/// longer with the first measurement above, or when it is not to carry any more.
class ContactLoss {
 public:
  explicit ContactLoss(const ContactConfirmation& config)
      : release_load_(config.release_load()), duration_(config.lost_duration()) {}

  /// `time` in s, not decreasing; `load` in N, positive when the sole is pressed.
  /// `deviation`: N, of an observed load, which must be below that instead where it is more; 0 of a
  /// measured one.
  void Update(double time, double load, bool carries, double deviation = 0);
  /// From here on anew: another phase, another plan.
  void Reset() { below_ = lost_ = false; }
  bool lost() const { return lost_; }
  void Archive(StateArchive* archive) { archive->Show(below_, lost_, since_); }

 private:
  double release_load_, duration_;  // N, s
  bool below_ = false, lost_ = false;
  double since_ = 0;  // s, when the load fell below
};

}  // namespace poise
