// How fast the COM may be controlled on a foot that was put down on something soft.
#pragma once

#include "components/balance/tasks/task.h"
#include "components/framework/state_archive.h"
#include "components/robot/robot_model.h"

namespace poise {

/// A foot on soft ground carries what is asked of it no faster than its leg's inertia m on the
/// ground's stiffness k lets it, √(k/m). The model's contacts are rigid: a COM controlled faster
/// than that swings the load to and fro until the sole tips. k follows from how far the foot has
/// sunk under its load since it became a contact.
class SoftGround {
 public:
  struct FootState {
    bool put_down = false;  ///< a contact, made by no step of the planner's own
    double height = 0;      ///< m, of the sole
    double load = 0;        ///< N
  };

  SoftGround() = default;  ///< no limit
  /// `period`, s, of a tick.
  SoftGround(const robot::RobotModel& model, double period);

  /// Once a tick.
  void Update(const robot::FootArray<FootState>& feet);
  /// `gains` at a lower frequency, with the same damping ratio, where the ground is soft.
  balance::TaskGains Limited(balance::TaskGains gains) const;
  void Archive(StateArchive* archive);

  /// kg, that a foot of this leg weighs vertically in the stance while its sole does not turn and
  /// the base rests: links and rotors.
  static double LegInertia(const robot::RobotModel& model, robot::Foot foot);

 private:
  struct Trace {
    bool known = false;           // of a foot that became a contact within the run
    bool stands = true;           // in the last tick
    double height = 0, load = 0;  // m, N, when it became one
    double compliance = 0;        // m/N, filtered
  };

  robot::FootArray<Trace> trace_;
  robot::FootArray<double> inertia_;  // kg
  double share_ = 0;                  // of the filter, in a tick
  double least_load_ = 0;             // N, more, from which on the ground shows itself
  double least_frequency_ = 0;        // rad/s
};

}  // namespace poise
