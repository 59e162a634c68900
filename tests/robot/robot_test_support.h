// The two robots of the tests, random states and motion along a velocity.
#pragma once

#include <random>
#include <string>

#include "components/robot/dynamics.h"
#include "components/robot_files/robot_files.h"

namespace poise::robot {

enum class TestRobot { kDyros, kMantis };

std::string RobotPath(TestRobot robot);
std::string UrdfPath(TestRobot robot);
std::string ReadWhole(const std::string& path);
RobotModel LoadTestRobot(TestRobot robot);

/// Any orientation, base within 2 m of `centre`, joints anywhere in a turn, velocities of a few m/s
/// and rad/s.
RobotState RandomState(const RobotModel& model, std::mt19937* random,
                       const Eigen::Vector3d& centre = Eigen::Vector3d::Zero());

Eigen::VectorXd Velocity(const RobotState& state);
void SetVelocity(const Eigen::VectorXd& velocity, RobotState* state);

/// The state moved for `time` along constant generalised velocity; its own velocity is kept.
RobotState Moved(const RobotState& state, const Eigen::VectorXd& velocity, double time);

}  // namespace poise::robot
