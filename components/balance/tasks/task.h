// Tasks of the operational space (13): what a robot shall accelerate, and how.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "components/balance/contact_dynamics.h"
#include "components/robot/dynamics.h"

namespace poise::balance {

struct TaskGains {
  double kp = 0;  ///< 1/s²
  double kd = 0;  ///< 1/s
};

/// Rows of a task that has six: translation, then rotation. A type of three has one half of them.
enum Axis { kX, kY, kZ, kTurnX, kTurnY, kTurnZ };
/// Axes that a task is to control, in the world's directions; all false: all that its type has.
using AxisSelection = std::array<bool, 6>;

/// Where a task is to be, world frame. A type reads what it is about and leaves the rest.
struct TaskTarget {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s²
  bool accelerates_only = false;  ///< a COM: x and y follow `acceleration` alone
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();          ///< frame to world
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< rad/s
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< rad/s²
  Eigen::VectorXd joint_position;  ///< rad, of all joints, in their order
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero();       ///< kg·m²/s, about the COM
  Eigen::Vector3d angular_momentum_rate = Eigen::Vector3d::Zero();  ///< kg·m²/s²
};

/// One state; `data` must hold its kinematics, feet and dynamics.
struct TaskState {
  const robot::RobotModel& model;
  const robot::RobotState& state;
  const robot::RobotData& data;
  /// s by which the joints' velocities are late. The task of a sole adds what its reference's
  /// acceleration changes the sole's velocity by in that time.
  double sole_delay = 0;
};

/// Rows of ẍ = J q̈ + J̇ q̇ and the f* that ẍ shall be; a task fills its own.
struct TaskRows {
  /// J, t×n; zero when a task gets it, or as the task itself left it.
  Eigen::Ref<Eigen::MatrixXd> jacobian;
  Eigen::Ref<Eigen::VectorXd> bias_acceleration;  ///< J̇ q̇, t×1
  Eigen::Ref<Eigen::VectorXd> acceleration;       ///< f*, t×1: (25), the reference's fed forward
};

struct TargetParts {
  bool position = false, rotation = false;  ///< each with its rates
  bool joints = false;
  bool angular_momentum = false;
};

/// A kind of motion with its gains, which may be set between ticks. No method allocates.
class Task {
 public:
  virtual ~Task() = default;
  virtual int num_rows() const = 0;
  /// What it reads of a target.
  virtual TargetParts needs() const = 0;
  /// Fills `rows`, which has num_rows() rows.
  virtual void Write(const TaskState& state, const TaskTarget& target, TaskRows* rows) const = 0;
  /// The target at which the task, at this state, has no error and is at rest.
  virtual void Hold(const TaskState& state, TaskTarget* target) const = 0;

  /// 0 until set.
  void set_gains(const TaskGains& gains) { gains_ = gains; }
  const TaskGains& gains() const { return gains_; }

 private:
  TaskGains gains_;
};

/// What a task is made of. A type refuses fields that it has no use for.
struct TaskSpec {
  std::string type;  ///< as TaskTypes() names it
  AxisSelection axes{};
  std::string link;                                 ///< URDF link; empty: the link of the body task
  std::optional<robot::Foot> foot;                  ///< its sole in place of a link
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< m, in the frame of link or sole
  std::vector<std::string> joints;                  ///< empty: all
};

/// Makes a task; throws std::invalid_argument, "field: what is wrong with it".
using MakeTask = std::unique_ptr<Task> (*)(const TaskSpec& spec, const robot::RobotModel& model);

struct TaskType {
  std::string_view name;  ///< of the file without `_task.cc`
  MakeTask make;
};

/// A file NAME_task.cc of this folder that defines MakeNameTask (MakeTask) is a type of its own.
const std::vector<TaskType>& TaskTypes();

/// Makes a task of the type `spec.type` of `types`; throws std::invalid_argument for one that is
/// not there.
std::unique_ptr<Task> CreateTask(const TaskSpec& spec, const robot::RobotModel& model,
                                 const std::vector<TaskType>& types = TaskTypes());

// What follows helps types to compute their tasks.

/// Smallest rotation vector from `actual` to `desired`, rad, in the axes both are given in.
Eigen::Vector3d OrientationError(const Eigen::Matrix3d& desired, const Eigen::Matrix3d& actual);

/// Copies the rows `selected` of `all`, which has as many as are known when compiling, to `to`.
template <class All, class To>
void CopySelected(const std::vector<int>& selected, const All& all, To&& to) {
  if (static_cast<Eigen::Index>(selected.size()) == All::RowsAtCompileTime) {
    to.template topRows<All::RowsAtCompileTime>() = all;
    return;
  }
  for (size_t i = 0; i < selected.size(); ++i) {
    to.row(static_cast<Eigen::Index>(i)) = all.row(selected[i]);
  }
}

/// Rows that `axes` selects of those from `first` to first + count; all when none is selected.
/// Throws std::invalid_argument for an axis outside of them.
std::vector<int> SelectedRows(const AxisSelection& axes, int first, int count);

/// Frame that `spec` names by link or foot, moved to its point. Throws std::invalid_argument.
robot::Frame TaskFrame(const TaskSpec& spec, const robot::RobotModel& model);

/// Throw std::invalid_argument for a link, foot or point, a point, or joints that are given.
void RefuseFrame(const TaskSpec& spec);
void RefusePoint(const TaskSpec& spec);
void RefuseJoints(const TaskSpec& spec);

/// f* of one axis: a_d + (k_p e + k_d ė).
inline double PdAcceleration(const TaskGains& gains, double acceleration, double error,
                             double velocity_error) {
  return acceleration + (gains.kp * error + gains.kd * velocity_error);
}

}  // namespace poise::balance
