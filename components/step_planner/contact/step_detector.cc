#include "components/step_planner/contact/step_detector.h"

namespace poise {

bool StepDetector::Update(double time, double margin) {
  if (contradicts_.Update(time, (margin < -excess_) != needed_, persistence_)) {
    needed_ = !needed_;
    contradicts_.Reset();
  }
  return needed_;
}

}  // namespace poise
