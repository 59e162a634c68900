// Which foot to put where, and how soon, so that the capture point is caught.
#pragma once

#include <Eigen/Core>

#include "components/balance/convex_polygon.h"
#include "components/framework/state_archive.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/legs/legs.h"
#include "components/step_planner/legs/reach.h"
#include "components/step_planner/stepping/cop_plan.h"
#include "components/step_planner/stepping/footsteps.h"
#include "components/step_planner/stepping/pendulum.h"

namespace poise::stepping {

struct StepLimits {
  double sole_margin = 0;   ///< m that a centre of pressure keeps off a sole's edge
  double acceleration = 1;  ///< m/s², of a swing foot, greatest
  double least_swing = 0;   ///< s
  double unload = 0;        ///< s, from the decision until a loaded foot leaves the ground
  double overshoot = 0;     ///< m beyond the capture point that a sole's centre comes down
  double ample_margin = 0;  ///< m of the capture point inside the new support; more is no better
  double longest = 0, widest = 0;  ///< m of a walk's step ahead, and aside beyond `spacing`
  double most_turn = 0;            ///< rad of a walk's step
  double spacing = 0;  ///< m, sideways between the soles' centres, when nothing asks for more
  /// m between the legs' lines at a foothold ahead of the stance sole or behind it; 0: there is
  /// none
  double leg_distance = 0;
};

/// The robot as a step sees it: in any horizontal axes, heading of the body along `yaw`.
struct StepState {
  Pendulum pendulum;
  FootArray<Eigen::Vector2d> sole{Eigen::Vector2d::Zero(),
                                  Eigen::Vector2d::Zero()};  ///< centres, m
  FootArray<double> sole_yaw{0, 0};                          ///< rad
  FootArray<bool> in_contact{true, true};
  double yaw = 0;  ///< rad
};

struct StepPlan {
  bool possible = false;                                    ///< false: no foot can step
  Foot foot = Foot::kRight;                                 ///< that swings
  double time = 0;                                          ///< s from now until it touches down
  Eigen::Vector2d foothold = Eigen::Vector2d::Zero();       ///< sole centre
  double yaw = 0;                                           ///< rad, of the sole
  Eigen::Vector2d cop = Eigen::Vector2d::Zero();            ///< centre of pressure until then
  Eigen::Vector2d capture_point = Eigen::Vector2d::Zero();  ///< at touch-down
  Eigen::Vector2d com = Eigen::Vector2d::Zero();            ///< at touch-down
  /// m from the capture point at touch-down to the edge of the new support less `sole_margin`,
  /// positive inside; negative: another step must follow; −∞: no foot can get there.
  double margin = 0;
  /// m from the COM at touch-down to the edge of the stance leg's reach, positive inside.
  double leg_margin = 0;
  double missed = 0;  ///< m from where the foot was wanted to the foothold
  double moved = 0;   ///< m from the foothold of the undisturbed gait; of a walk's step
  Crossing crossing = Crossing::kNone;
  bool around = false;  ///< the way goes around the stance leg, by `corner`, m
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();

  void Archive(StateArchive* archive);
};

/// A walk that a step is part of.
struct Gait {
  WalkCommand command;
  double period = 1;    ///< s from one touch-down to the next
  double transfer = 0;  ///< s from a touch-down until the foot carries
  double gain = 0;      ///< of the capture point's error in the centre of pressure
};

/// Least time of a quintic over `distance`, m, whose acceleration stays below `acceleration`, m/s².
double LeastSwingTime(double distance, double acceleration);

/// Pure functions of model, reach and limits.
class StepChoice {
 public:
  StepChoice() = default;
  /// Throws RobotError where the robot cannot stand and has a reach or a `leg_distance`.
  StepChoice(const robot::RobotModel& model, const Reach& reach, const StepLimits& limits)
      : feet_{model.feet()[0], model.feet()[1]}, reach_(reach), limits_(limits) {
    if (limits.leg_distance > 0 || !reach.empty()) legs_ = Legs(model);
  }

  /// Share of what steps lower the COM by that footholds count on. A step beside is down before the
  /// COM is, and the knee that bends meanwhile is what absorbs a body that is not where it was
  /// planned to be: G1 with 12 joints stands 129 of 192 pushes with 0, 114 with the height that the
  /// COM has by then, 107 with 1. In line with the standing foot a step takes twice as long.
  static constexpr double CountedLowering(Crossing crossing) {
    return crossing == Crossing::kNone ? 0 : 1;
  }

  /// The step to begin with, of the plans of up to three steps the one that leaves the least to be
  /// desired: m of the capture point outside the last soles less `ample_margin`, and what steps and
  /// time cost. Not possible without a foot that can step. A foot that is not in contact swings at
  /// once, from where it is.
  StepPlan Choose(const StepState& state) const;
  /// Chooses likewise among the plans that begin with `foot`, which leaves the ground in `unload`,
  /// s.
  StepPlan Next(const StepState& state, Foot foot, double unload) const;
  /// The step of `foot`, whose least time is iterated from the swing that it takes, around the
  /// stance leg where it must. One that takes longer than the pendulum lets a step be is none.
  StepPlan Plan(const StepState& state, Foot foot, double unload,
                Crossing crossing = Crossing::kNone) const;
  /// The foothold of `foot` for a touch-down `time` s from now, the centre of pressure at the
  /// stance sole's point nearest to the capture point. Within what both legs span, also
  /// where the COM has left it.
  StepPlan At(const StepState& state, Foot foot, double time,
              Crossing crossing = Crossing::kNone) const;
  /// The step of `foot` that goes on with `gait`, its touch-down `time` s from now: where the
  /// capture point has its nominal place from the sole.
  StepPlan StrideAt(const StepState& state, Foot foot, const Gait& gait, double time) const;
  /// That step, its time the gait's: sooner where the legs do not reach so far, later where the
  /// swing takes longer. `unload`: s, until the foot leaves the ground.
  StepPlan Stride(const StepState& state, Foot foot, const Gait& gait, double unload) const;
  /// m, world: the capture point as the other foot leaves the ground.
  Eigen::Vector2d CapturePointAtLiftOff(const StepState& state, Foot stance,
                                        const Gait& gait) const;
  /// Where the gait has the capture point on the sole of `stance` with `left` s until the other one
  /// carries: that sole's middle, as the centre of pressure, takes it there in time.
  CaptureReference StrideReference(const StepState& state, Foot stance, const Gait& gait,
                                   double left) const;
  /// The step of `foot` that puts it beside the other one, as when standing, with the COM above
  /// that.
  StepPlan Beside(const StepState& state, Foot foot, double time) const;
  /// The step catches the capture point, or comes nearer to it than the soles where they are while
  /// the stance leg follows the COM.
  bool Helps(const StepState& state, const StepPlan& plan) const;
  /// The sole of `foot`, `sole_margin` off its edges.
  balance::ConvexPolygon Sole(const StepState& state, Foot foot) const {
    return SoleAt(feet_[foot], limits_.sole_margin, state.sole[foot], state.sole_yaw[foot]);
  }
  /// Hull of the soles in contact, `margin`, m, off their edges, or `sole_margin`.
  balance::ConvexPolygon Soles(const StepState& state, double margin) const;
  balance::ConvexPolygon Soles(const StepState& state) const {
    return Soles(state, limits_.sole_margin);
  }
  /// The stance sole's point nearest to the capture point, less `sole_margin`.
  Eigen::Vector2d BrakingCop(const StepState& state, Foot stance) const;
  const StepLimits& limits() const { return limits_; }
  const Reach& reach() const { return reach_; }
  const Legs& legs() const { return legs_; }  ///< of a robot that has a reach
  const robot::FootModel& foot(Foot foot) const { return feet_[foot]; }

 private:
  FootstepLimits StrideLimits() const;
  /// The step until its touch-down with the centre of pressure at `cop`.
  StepPlan Until(const StepState& state, Foot foot, double time, const Eigen::Vector2d& cop) const;
  /// The foothold nearest to `wanted`, in axes of the heading from the stance sole, and its margin;
  /// the COM lowered by `share` of what steps lower it by.
  void PutDown(const StepState& state, const Eigen::Vector2d& wanted, double share,
               StepPlan* plan) const;
  /// m that the capture point is outside after `plan` and up to `more` steps after it, and what
  /// those cost.
  double CostAfter(const StepState& state, const StepPlan& plan, int more) const;
  /// The plan that begins with `foot`, after `unload`, s, and costs less than `least`, which
  /// becomes its cost.
  StepPlan Best(const StepState& state, Foot foot, double unload, int more, double* least) const;
  /// m between the legs' lines, `foot` at `foothold`, the other at the origin, the COM at `com`, in
  /// axes of the heading.
  double DistanceOfLegs(Foot foot, const Eigen::Vector2d& foothold,
                        const Eigen::Vector2d& com) const;
  /// Draws `foothold` to its own side until the legs' lines are `leg_distance` apart; false: they
  /// are not there either.
  bool ClearOfLeg(Foot foot, const Eigen::Vector2d& com, Eigen::Vector2d* foothold) const;
  /// By which corner of the stance sole, `gap` off, a foot goes from `from` to the plan's foothold;
  /// in axes of the heading from the stance sole. False: there is no way.
  bool WayAround(double side, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                 StepPlan* plan) const;

  FootArray<robot::FootModel> feet_;
  Reach reach_;
  Legs legs_;
  StepLimits limits_;
};

}  // namespace poise::stepping
