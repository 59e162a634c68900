#include "components/step_planner/contact/step_detector.h"

namespace poise {
namespace {

constexpr double kTimeTolerance = 1e-9;  // s, far below a tick, far above rounding

}  // namespace

bool StepDetector::Update(double time, double margin) {
  if ((margin < -beyond_) == needed_) {
    changing_ = false;
    return needed_;
  }
  if (!changing_) {
    changing_ = true;
    since_ = time;
  }
  if (time - since_ >= persistence_ - kTimeTolerance) {
    needed_ = !needed_;
    changing_ = false;
  }
  return needed_;
}

}  // namespace poise
