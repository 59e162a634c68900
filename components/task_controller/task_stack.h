// The stacked tasks of a support: COM position, body orientation and, in single support, the free
// foot's pose.
#pragma once

#include <Eigen/Core>
#include <array>

#include "components/messages/motion.h"
#include "components/robot/dynamics.h"

namespace poise {

struct PdGains {
  double kp = 0;  ///< 1/s²
  double kd = 0;  ///< 1/s
};

/// Where the tasks are to lead, world.
struct TaskReferences {
  PointMotion com;
  RotationMotion body;
  std::array<PointMotion, 2> foot;              ///< sole centre, of a foot out of contact
  std::array<RotationMotion, 2> foot_rotation;  ///< likewise
};

/// Smallest rotation vector from `actual` to `desired`, rad, in the axes both are given in (world).
Eigen::Vector3d OrientationError(const Eigen::Matrix3d& desired, const Eigen::Matrix3d& actual);

/// Rows: COM (3), body orientation (3), for each foot out of contact its sole's position and
/// orientation (6); world axes. f* = k_p e + k_d ė + ẍ_d: (25) with the acceleration of the
/// reference fed forward, turning ones too; for a resting reference it is (25).
class TaskStack {
 public:
  TaskStack(const robot::RobotModel& model, PdGains com, PdGains orientation, PdGains foot);

  static int NumRows(const std::array<bool, 2>& in_contact) {
    return 6 + (in_contact[0] ? 0 : 6) + (in_contact[1] ? 0 : 6);
  }
  static constexpr int kMaxRows = 12;

  /// `data` must hold kinematics, feet and dynamics of one state; at least one foot in contact.
  /// Never allocates.
  void Update(const robot::RobotModel& model, const robot::RobotData& data,
              const TaskReferences& references, const std::array<bool, 2>& in_contact);

  int num_rows() const { return num_rows_; }
  auto jacobian() const { return jacobian_.topRows(num_rows_); }                 ///< J, t×n
  auto bias_acceleration() const { return bias_acceleration_.head(num_rows_); }  ///< J̇q̇, t×1
  auto acceleration() const { return acceleration_.head(num_rows_); }            ///< f*, t×1
  const Eigen::Vector3d& body_orientation_error() const { return body_error_; }

 private:
  PdGains com_, orientation_, foot_;
  int num_rows_ = 0;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic> jacobian_;
  Eigen::VectorXd bias_acceleration_, acceleration_;
  Eigen::Vector3d body_error_ = Eigen::Vector3d::Zero();
};

}  // namespace poise
