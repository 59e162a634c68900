// MuJoCo's model of a robot, and how MuJoCo's errors are caught.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise {

/// MuJoCo called mju_error.
class MujocoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While one lives, this thread's errors of MuJoCo are thrown as MujocoError and its warnings are
/// kept: MuJoCo reports through process-wide handlers and would end the process.
class MujocoReports {
 public:
  MujocoReports();
  /// The first warning since construction, empty when there was none.
  const char* warning() const;
};

struct MujocoDelete {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using MujocoModelPtr = std::unique_ptr<mjModel, MujocoDelete>;
using MujocoDataPtr = std::unique_ptr<mjData, MujocoDelete>;

/// A robot in MuJoCo: a free base and hinges, without limits, damping, armature and actuators. Each
/// body, and the world, has one geometry that collides with nothing, for contacts to refer to.
struct MujocoRobot {
  MujocoModelPtr model;
  /// MuJoCo's numbers: by the RobotModel's body, and by its joint.
  std::vector<int> body, geom, joint_position, joint_velocity;
  int world_geom = 0;
};

/// With room for `max_contacts` contacts of three rows. Throws ConfigError when MuJoCo refuses it.
MujocoRobot BuildMujocoRobot(const robot::RobotModel& model, int max_contacts, double step);

}  // namespace poise
