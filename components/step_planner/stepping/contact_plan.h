// The contact plan: which foot comes down where, and when.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/footsteps.h"
#include "poise/support_plan_t.hpp"

namespace poise::stepping {

/// What a planner of steps does: the stage of its first step, or what comes between steps.
enum class Stage {
  kStanding,   ///< nothing: another planner may move the feet
  kShifting,   ///< the capture point goes to where the first step begins
  kUnloading,  ///< the foot's load goes over to the other one
  kSwinging,   ///< the foot is in the air
  kTouching,   ///< it has met the ground and is pressed down; the model knows no contact yet
  kLoading,    ///< it takes its load
  kCatching    ///< both feet carry until the COM rests or another step begins
};

/// What happens to a foot's load.
enum class TransitionKind : int8_t {
  kNone = support_plan_t::TRANSITION_NONE,
  kUnloading = support_plan_t::TRANSITION_UNLOADING,
  kLoading = support_plan_t::TRANSITION_LOADING
};
inline TransitionKind TransitionOf(Stage stage) {
  return stage == Stage::kUnloading ? TransitionKind::kUnloading
         : stage == Stage::kLoading ? TransitionKind::kLoading
                                    : TransitionKind::kNone;
}

/// One step. Times in s of the run, as planned until they have come.
struct Footstep {
  Foot foot = Foot::kRight;
  Foothold at;            ///< where its sole comes down
  double unload = 0;      ///< its load begins to go over to the other foot
  double lift_off = 0;    ///< it leaves the ground
  double touch_down = 0;  ///< it comes down
  double load = 0;        ///< it has its load again
  bool around = false;    ///< its way goes around the stance leg, by `corner`, m, world
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();

  void Archive(StateArchive* archive) {
    archive->Show(foot, at, unload, lift_off, touch_down, load, around, corner);
  }
};

/// The steps to come, in order: the first is under way or next. Planners fill it, FootMotion
/// carries its first step out. Never allocates.
class ContactPlan {
 public:
  static constexpr size_t kMost = 4;

  void Clear() { size_ = 0; }
  /// No effect beyond kMost steps.
  void Add(const Footstep& step) {
    if (size_ < kMost) step_[size_++] = step;
  }
  bool empty() const { return size_ == 0; }
  const Footstep* begin() const { return step_.data(); }
  const Footstep* end() const { return step_.data() + size_; }
  Footstep& first() { return step_[0]; }
  const Footstep& first() const { return step_[0]; }
  /// The first step's foot has become a contact at `time` and has its load at `load`, s.
  void Land(double time, double load) {
    landed_ = first();
    landed_.touch_down = time;
    landed_.load = load;
    for (size_t i = 1; i < size_; ++i) step_[i - 1] = step_[i];
    --size_;
  }
  const Footstep& landed() const { return landed_; }  ///< the last step that has come down
  void Archive(StateArchive* archive) { archive->Show(step_, size_, landed_); }

 private:
  std::array<Footstep, kMost> step_;
  size_t size_ = 0;
  Footstep landed_;
};

}  // namespace poise::stepping
