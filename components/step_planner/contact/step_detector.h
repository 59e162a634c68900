// Whether a step is needed, from the capture point's distance to the edge of the soles.
#pragma once

#include "components/framework/state_archive.h"
#include "components/framework/tick_time.h"

namespace poise {

/// With hysteresis in time, so that neither noise nor skipped ticks raise a false alarm.
class StepDetector {
 public:
  StepDetector() = default;
  /// Needed once the margin has been below −`excess` (m) for `persistence` (s), and no longer once
  /// it has been above for as long.
  StepDetector(double excess, double persistence) : excess_(excess), persistence_(persistence) {}

  /// `time` in s, not decreasing; `margin` in m, positive inside.
  bool Update(double time, double margin);
  void Archive(StateArchive* archive) {
    archive->Show(needed_);
    contradicts_.Archive(archive);
  }

 private:
  double excess_ = 0, persistence_ = 0;
  bool needed_ = false;
  LastingCondition contradicts_;  // the margin, `needed_`
};

}  // namespace poise
