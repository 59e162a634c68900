#include "tests/robot/robot_test_support.h"

#include <fstream>
#include <iterator>

namespace poise::robot {

std::string RobotPath(TestRobot robot) {
  return std::string(POISE_SOURCE_DIR) + (robot == TestRobot::kDyros
                                              ? "/deploy/robots/dyros/dyros_legs.pbtxt"
                                              : "/tests/robot/data/mantis.pbtxt");
}

std::string UrdfPath(TestRobot robot) {
  const std::string path = RobotPath(robot);
  return path.substr(0, path.rfind('.')) + ".urdf";
}

std::string ReadWhole(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

RobotModel LoadTestRobot(TestRobot robot) { return LoadRobotFiles(RobotPath(robot)); }

RobotState RandomState(const RobotModel& model, std::mt19937* random,
                       const Eigen::Vector3d& centre) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  RobotState state(model.num_joints());
  state.base_orientation =
      Eigen::Quaterniond(normal(*random), normal(*random), normal(*random), normal(*random))
          .normalized();
  for (int i = 0; i < 3; ++i) {
    state.base_position[i] = centre[i] + 2 * uniform(*random);
    state.base_linear_velocity[i] = 2 * uniform(*random);
    state.base_angular_velocity[i] = 3 * uniform(*random);
  }
  for (int j = 0; j < model.num_joints(); ++j) {
    state.joint_position[j] = 3.1 * uniform(*random);
    state.joint_velocity[j] = 4 * uniform(*random);
  }
  return state;
}

Eigen::VectorXd Velocity(const RobotState& state) {
  Eigen::VectorXd v(6 + state.joint_velocity.size());
  v << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
  return v;
}

void SetVelocity(const Eigen::VectorXd& velocity, RobotState* state) {
  state->base_linear_velocity = velocity.head<3>();
  state->base_angular_velocity = velocity.segment<3>(3);
  state->joint_velocity = velocity.tail(velocity.size() - 6);
}

RobotState Moved(const RobotState& state, const Eigen::VectorXd& velocity, double time) {
  RobotState moved = state;
  moved.base_position += time * velocity.head<3>();
  const Eigen::Vector3d turn = time * velocity.segment<3>(3);
  if (const double angle = turn.norm(); angle > 0) {
    moved.base_orientation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * state.base_orientation)
            .normalized();
  }
  moved.joint_position += time * velocity.tail(velocity.size() - 6);
  return moved;
}

}  // namespace poise::robot
