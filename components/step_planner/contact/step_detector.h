// Whether a step is needed, from the capture point's distance to the edge of the soles.
#pragma once

#include "components/framework/state_archive.h"

namespace poise {

/// With hysteresis in time, so that neither noise nor skipped ticks raise a false alarm.
class StepDetector {
 public:
  StepDetector() = default;
  /// Needed once the margin has been below −`beyond` (m) for `persistence` (s), and no longer once
  /// it has been above for as long.
  StepDetector(double beyond, double persistence) : beyond_(beyond), persistence_(persistence) {}

  /// `time` in s, not decreasing; `margin` in m, positive inside.
  bool Update(double time, double margin);
  void Archive(StateArchive* archive) { archive->Show(needed_, changing_, since_); }

 private:
  double beyond_ = 0, persistence_ = 0;
  bool needed_ = false;
  bool changing_ = false;
  double since_ = 0;  // s, when the margin began to contradict `needed_`
};

}  // namespace poise
