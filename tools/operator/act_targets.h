// To whom in a run an operator's acts go, and the names that they may use.
#pragma once

#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/robot/robot_model.h"

namespace poise {

/// The robot of a run, by the texts that it carries. Throws RobotError.
robot::RobotModel RobotOf(const RunSpec& spec);

/// The channel at a component's input for acts; empty: it has none.
std::string ActChannel(const Graph& graph, int component);

struct ActTargets {
  int simulator = -1;               ///< index in the graph, of who takes pushes; -1: nobody
  int planner = -1;                 ///< likewise steps and walking
  std::vector<std::string> bodies;  ///< of the robot's model, as act_t's body counts them
  std::vector<std::string> feet;    ///< likewise act_t's foot
  double weight = 0;                ///< N, the robot's
};

/// Throws RobotError.
ActTargets FindActTargets(const RunSpec& spec);

}  // namespace poise
