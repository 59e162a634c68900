// The robot of a maker's file in MuJoCo, read by MuJoCo's own parser, beside what the importer made
// of the same file: an oracle for dynamics and contacts.
#pragma once

#include <mujoco/mujoco.h>

#include <Eigen/Dense>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "components/robot/dynamics.h"
#include "tools/robot_import/robot_import.h"

namespace poise {

class MujocoTwin {
 public:
  /// Imports the file and reads it with MuJoCo. Masses that the importer repaired are given to
  /// both. Throws std::runtime_error.
  explicit MujocoTwin(const std::filesystem::path& file);

  const robot::RobotModel& model() const { return model_; }

  /// At one state, in our order and axes of velocities: base linear, base angular (world), joints.
  struct Dynamics {
    Eigen::MatrixXd mass;           ///< n×n
    Eigen::VectorXd bias, gravity;  ///< b, g
    Eigen::Vector3d com;            ///< m, world
    Eigen::MatrixXd com_jacobian;   ///< 3×n
    struct Foot {
      Eigen::Isometry3d sole;        ///< in the world
      Eigen::MatrixXd jacobian;      ///< 6×n, of the sole's origin, world axes
      Eigen::VectorXd acceleration;  ///< J̇ v, 6×1
    };
    std::array<Foot, 2> foot;  ///< right first
  };
  Dynamics At(const robot::RobotState& state) const;

 private:
  void TakeInertias(const Robot& robot, const std::string& text);
  void SetState(const robot::RobotState& state) const;

  robot::RobotModel model_;
  std::unique_ptr<mjModel, void (*)(mjModel*)> m_{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> d_{nullptr, mj_deleteData};
  Eigen::Matrix3d facing_ = Eigen::Matrix3d::Identity();  ///< our root's axes in the file's
  int root_ = -1;                                         ///< body
  std::vector<int> position_, velocity_;                  ///< MuJoCo's addresses, by our joint
};

}  // namespace poise
