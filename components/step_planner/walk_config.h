// Walking's configuration, and what the robot makes of it.
#pragma once

#include <string>
#include <vector>

#include "components/robot/robot_model.h"
#include "components/step_planner/step_planner.pb.h"
#include "components/step_planner/stepping/quasi_static_walk.h"

namespace poise {

/// Throws ConfigError "walk.command[1].time" ...: commands or told edges are out of order. Each
/// number has been held to its rule already (CheckFields).
void CheckWalkConfig(const WalkConfig& config);

/// Reach and spacing of this robot's quasi-static walk, whose COM stands at its standing height.
/// Throws ConfigError when its legs reach nothing or not what is configured.
stepping::StepChoice MakeWalkChoice(const WalkConfig& config, const robot::RobotModel& model);

/// The numbers of this robot's quasi-static walk. What nobody gave is that of the paper's robot in
/// units of g and of the standing COM's height. `choice`: MakeWalkChoice's.
stepping::QuasiStaticSpec MakeQuasiStaticSpec(const WalkConfig& config,
                                              const ContactConfirmation& contact,
                                              const robot::RobotModel& model,
                                              const stepping::StepChoice& choice);

/// Both. Throws as MakeWalkChoice.
stepping::QuasiStaticWalk MakeQuasiStaticWalk(const WalkConfig& config,
                                              const ContactConfirmation& contact,
                                              const robot::RobotModel& model);

/// What this robot will not walk as it is configured, and settings without effect: a sentence each.
/// `choice`: of the walk's steps, MakeWalkChoice's where it is quasi-static, else MakeStepChoice's;
/// not looked at without walk.enabled.
std::vector<std::string> WalkWarnings(const WalkConfig& config, const robot::RobotModel& model,
                                      const stepping::StepChoice& choice);

/// What is commanded at a time of the run, after a number of steps.
class WalkCommands {
 public:
  WalkCommands() = default;
  explicit WalkCommands(const WalkConfig& config);
  /// `time`: s, in any order; `num_steps`: begun since the run's start. Standing before the first.
  stepping::WalkCommand At(double time, int num_steps) const;

 private:
  struct Entry {
    double time;      // s
    int after_steps;  // begun before
    stepping::WalkCommand command;
  };
  std::vector<Entry> entry_;
};

}  // namespace poise
