// A foot that was to carry and carries nothing.
#pragma once

#include <algorithm>

#include "components/framework/state_archive.h"
#include "components/framework/tick_time.h"

namespace poise {

/// Lost once a foot that is to carry has measured less than release_load for kLostDuration;
/// no longer with the first measurement above, or when it is not to carry any more.
class ContactLoss {
 public:
  /// s; longer than the rattle of a foot that a push rocks.
  static constexpr double kLostDuration = 0.1;

  explicit ContactLoss(double release_load) : release_load_(release_load) {}

  /// `time` in s, not decreasing; `load` in N, positive when the sole is pressed.
  /// `deviation`: N, of an observed load, which must be below that instead where it is more; 0 of a
  /// measured one.
  void Update(double time, double load, bool carries, double deviation = 0) {
    lost_ =
        empty_.Update(time, carries && load < std::max(release_load_, deviation), kLostDuration);
  }
  /// From here on anew: another phase, another plan.
  void Reset() {
    empty_.Reset();
    lost_ = false;
  }
  bool lost() const { return lost_; }
  void Archive(StateArchive* archive) { archive->Show(empty_, lost_); }

 private:
  double release_load_;     // N
  LastingCondition empty_;  // it is to carry and does not
  bool lost_ = false;
};

}  // namespace poise
