// Where the feet go for a commanded velocity.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/step_planner/legs/feet.h"

namespace poise::stepping {

/// A level sole: its centre, m, and its heading, rad.
struct Foothold {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double yaw = 0;

  void Archive(StateArchive* archive) { archive->Show(position, yaw); }
};

/// The walk that is commanded, in axes of the robot's heading.
struct WalkCommand {
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m/s ahead, to the left
  double turn_rate = 0;                                ///< rad/s, to the left
  bool stepping = false;                               ///< walks, if only in place
  /// s from touch-down to touch-down; above 0, `stride` says where each foot comes down from the
  /// other sole, in its axes, and `velocity` and `turn_rate` are what that comes to.
  double period = 0;
  FootArray<Foothold> stride{};

  /// The footholds are given, by the port `stride`; else they follow from the velocity.
  bool has_footholds() const { return period > 0; }
  bool in_place() const { return velocity.isZero(0) && turn_rate == 0; }
  void Archive(StateArchive* archive) {
    archive->Show(velocity, turn_rate, stepping, period, stride);
  }
};

struct FootstepLimits {
  double spacing = 0;        ///< m between soles side by side
  double least_spacing = 0;  ///< m, sideways between soles that do not touch
  double longest = 0;        ///< m ahead or back in a step
  double widest = 0;         ///< m of a step to the side beyond `spacing`
  double most_turn = 0;      ///< rad in a step
};

/// Where `foot` comes down when the other stands at `stance`, for a step every `period` s. Ahead
/// each step goes half a stride. To the side, and in a turn, the foot of that side goes out by what
/// two steps ask for and the other comes beside it: so no foot crosses or turns towards the other.
Foothold NextFootstep(const Foothold& stance, Foot foot, const WalkCommand& command, double period,
                      const FootstepLimits& limits);

/// A step of a walk that goes on as it is commanded; m, world.
struct Stride {
  Foothold next;  ///< where the foot comes down
  /// From the stance sole to the capture point as the other foot leaves the ground, and from the
  /// next one as that carries.
  Eigen::Vector2d begin = Eigen::Vector2d::Zero(), end = Eigen::Vector2d::Zero();
};
/// Each sole carries alone for `period` s, by its middle. Two steps L₁ and L₂ that come again and
/// again have ξ − p = (e L₁ + L₂)/(e² − 1) as the first begins, e = exp(ω `period`).
Stride NominalStride(const Foothold& stance, Foot foot, const WalkCommand& command, double period,
                     double frequency, const FootstepLimits& limits);

/// `step`, beside `stance`, moved towards `wanted` by at most `most`, m and rad; the soles do not
/// touch.
Foothold Towards(const Foothold& step, const Foothold& wanted, double most, const Foothold& stance,
                 Foot foot, const FootstepLimits& limits);

/// The foot that steps first: the left one to go or turn left, else the right one.
Foot FirstFoot(const WalkCommand& command);

/// `command` approached from `from` by at most `speed`, m/s, and `turn`, rad/s.
WalkCommand Approach(const WalkCommand& from, const WalkCommand& command, double speed,
                     double turn);

}  // namespace poise::stepping
