#include "components/step_planner/stepping/foot_motion.h"

#include <algorithm>

#include "components/step_planner/legs/reach.h"
#include "components/step_planner/stepping/footwork.h"

namespace poise::stepping {
namespace {

// Share of a swing before which a load is the ground that the foot leaves, or a tap on the way up.
constexpr double kRises = 0.5;
// m above the ground of a sole's lowest corner, from which on an observed load counts.
constexpr double kLowSole = 0.015;

/// m, of the sole's lowest corner.
double LowestCorner(const Eigen::Isometry3d& sole, const robot::FootModel& model) {
  const balance::ConvexPolygon outline = SoleAt(model, 0, Eigen::Vector2d::Zero(), 0);
  double lowest = 0;
  for (const Eigen::Vector2d& corner : outline.corners()) {
    lowest = std::min(lowest, sole.linear().row(2).head<2>().dot(corner));
  }
  return sole.translation().z() + lowest;
}

}  // namespace

void FootMotion::LiftOff(const PointMotion& from, const Eigen::Matrix3d& rotation,
                         const Footstep& step, double ground, double expected, const SwingSpec& way,
                         double time) {
  const Eigen::Vector2d& at = step.at.position;
  swing_.Begin(from, rotation, {at.x(), at.y(), ground},
               Eigen::AngleAxisd(step.at.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix(), time,
               step.touch_down, way);
  if (step.around) swing_.GoAround(step.corner);
  landing_.BeginSwing(expected, time + kRises * (swing_.end() - time));
  reference_ = from;
  rotation_ = {.rotation = rotation};
}

void FootMotion::Move(const Footstep& step, double time) {
  swing_.Move(step.at.position, time, step.touch_down);
}

bool FootMotion::Update(const StepInput& input, Foot foot, const robot::FootModel& model) {
  const Eigen::Isometry3d& sole = input.sole[foot];
  const double deviation = input.load_deviation[foot];
  const bool observed = landing_.spec().observed_load > 0 && deviation > 0;
  const bool counts = !observed || input.time >= swing_.end() ||
                      LowestCorner(sole, model) < swing_.foothold().z() + kLowSole;
  landing_.Measure(input.time, counts ? input.load[foot] : 0, deviation);
  // What has touched looks for the ground from where it is, should it lose it.
  const bool due = input.time > swing_.end() || landing_.state() != Landing::State::kSwing;
  // A search goes on from where the last tick has left the foot.
  if (!due) reference_ = swing_.At(input.time);
  rotation_ = swing_.RotationAt(input.time);
  Eigen::Matrix3d turn = rotation_.rotation;
  if (landing_.Update(true, due, sole, &reference_, &turn)) rotation_ = {.rotation = turn};
  return landing_.confirmed();
}

}  // namespace poise::stepping
