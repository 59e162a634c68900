// RobotModel: the constant description of a floating-base robot, from a URDF and a Robot file.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/foot.h"

namespace poise::robot {

/// A URDF or robot description that cannot work. what() is one line naming the link, joint or field
/// and the remedy.
class RobotError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A moving body: a URDF link with every link attached to it by fixed joints merged in. Body 0 is
/// the floating base.
struct Body {
  std::string name;  ///< of the URDF link that the moving joint carries (the root link for body 0)
  int parent = -1;   ///< body index; parents come before children
  int joint = -1;    ///< index of the joint to the parent; -1 for the base
  double mass = 0;   ///< kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      ///< m, body frame
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< kg·m², about the COM, body axes
};

/// A revolute joint. Its index is its place in joint_position, in torque and in every message.
struct Joint {
  std::string name;
  int body = -1;  ///< child body, always the joint's index + 1
  Eigen::Isometry3d origin =
      Eigen::Isometry3d::Identity();  ///< joint frame in the parent body at zero position
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, joint frame (= child body frame)
  double lower = 0, upper = 0;                      ///< rad; infinite for a continuous joint
  double effort = 0;                                ///< N·m
  double velocity_limit = 0;                        ///< rad/s
};

struct MotorModel {
  double gear_ratio = 1, torque_constant = 0;  ///< (54)
  double rated_current = 0, peak_current = 0;  ///< A
  double reflected_inertia = 0;                ///< kg·m², H² J_m
  double coulomb_friction = 0, viscous_friction = 0, static_friction = 0, stribeck_velocity = 0;
  int encoder_counts = 0;      ///< per motor revolution
  bool current_sensor = true;  ///< whether the drive reports its current
  double torque_per_ampere() const { return gear_ratio * torque_constant; }
};

/// What a sole is computed with, in arrays of a fixed size.
inline constexpr int kMaxSoleVertices = 16;

/// A flat sole: a rectangle about its frame's origin, or a convex polygon with the origin inside
/// (components/robot/sole.h).
struct FootModel {
  std::string name;
  int body = -1;
  Eigen::Isometry3d sole = Eigen::Isometry3d::Identity();  ///< sole frame in the body frame
  double length = 0, width = 0;                            ///< m, of a polygon its extent
  std::vector<Eigen::Vector2d> vertices;  ///< m, sole frame, anticlockwise; none for a rectangle
  bool force_sensor = true;               ///< whether the foot has a six-axis sensor
  bool rectangular() const { return vertices.empty(); }
};

/// A link of the URDF, one that is fixed to a body or the body's own.
struct Frame {
  std::string name;
  int body = -1;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< in the body frame
};

struct ImuModel {
  int body = -1;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< IMU frame in the body frame
  double gyro_noise = 0, gyro_bias = 0, accelerometer_noise = 0, accelerometer_bias = 0;
};

/// How the robot stands when nothing else is said.
struct StanceModel {
  Eigen::VectorXd joint_position;      ///< rad, by joint; 0 where the file says nothing
  std::optional<double> com_height;    ///< m above the soles
  std::optional<double> foot_spacing;  ///< m between the soles' centres in y
};

/// What lies between a joint's motor and its link, and between its readings and the controller.
struct DriveTrainModel {
  double torque_lag = 0;          ///< s
  double current_resolution = 0;  ///< A
  double backlash = 0;            ///< rad at the joint
  double gear_stiffness = 0;      ///< N·m/rad at the joint; 0: rigid
  double gear_damping = 0;        ///< N·m·s/rad at the joint
  bool link_encoder = false;
  double sensor_delay = 0;  ///< s
};

inline constexpr double kGravity = 9.80665;  ///< m/s², standard gravity, along -z of the world

/// Configuration and velocity. Velocity order of the whole project: v = [base linear; base angular;
/// joints], base linear velocity of the base frame's origin, both base parts in world axes.
struct RobotState {
  Eigen::Vector3d base_position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond base_orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d base_linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d base_angular_velocity = Eigen::Vector3d::Zero();
  Eigen::VectorXd joint_position;
  Eigen::VectorXd joint_velocity;
  /// What the robot carries beyond its model, as if fixed to the base: kg, and kg·m (mass times
  /// place) in the base frame. An error of the model's COM is a moment without mass.
  double load_mass = 0;
  Eigen::Vector3d load_moment = Eigen::Vector3d::Zero();

  RobotState() = default;
  explicit RobotState(int num_joints)
      : joint_position(Eigen::VectorXd::Zero(num_joints)),
        joint_velocity(Eigen::VectorXd::Zero(num_joints)) {}
};

/// The same tree as flat constants, for the recursions.
struct KinematicTree {
  /// Rotation of the child body in its parent = constant + cosine cos q + sine sin q.
  struct JointTransform {
    Eigen::Matrix3d constant, cosine, sine;
    Eigen::Vector3d offset;    ///< m, joint frame's origin in the parent body
    Eigen::Vector3d axis;      ///< unit, in the parent body
    double reflected_inertia;  ///< kg·m²
  };
  struct BodyMass {
    int parent;
    double mass, subtree_mass;  ///< kg, of the body and of everything it carries
    Eigen::Vector3d com;        ///< m, body frame
    Eigen::Matrix3d inertia;    ///< kg·m², about the COM, body axes
  };
  std::vector<JointTransform> joints;
  std::vector<BodyMass> bodies;
  std::vector<std::vector<int>> supporting_joints;  ///< by body, nearest first
};

/// What a robot is made of. Parents come before their children; a motor for each joint;
/// indices within range.
struct RobotParts {
  std::string name;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<MotorModel> motors;  ///< by joint index
  FootArray<FootModel> feet;
  std::vector<Frame> frames;  ///< every link of the URDF, in order of the names
  ImuModel imu;
  StanceModel stance;
  DriveTrainModel drive_train;
  int body_task_body = 0;                    ///< body whose orientation the body task controls
  double force_noise = 0, moment_noise = 0;  ///< N, N·m, of the feet's sensors
};

/// Immutable. Joints are in depth-first order of the URDF tree; nothing may assume more than that.
/// components/robot_files makes it of a URDF and a Robot file.
class RobotModel {
 public:
  /// Makes a model of nothing, to be assigned to.
  RobotModel() = default;
  explicit RobotModel(RobotParts parts);

  const std::string& name() const { return parts_.name; }
  int num_joints() const { return static_cast<int>(parts_.joints.size()); }
  int num_velocities() const { return num_joints() + 6; }
  const std::vector<Body>& bodies() const { return parts_.bodies; }
  const std::vector<Joint>& joints() const { return parts_.joints; }
  const std::vector<MotorModel>& motors() const { return parts_.motors; }  ///< by joint index
  const FootArray<FootModel>& feet() const { return parts_.feet; }
  const ImuModel& imu() const { return parts_.imu; }
  const StanceModel& stance() const { return parts_.stance; }
  const DriveTrainModel& drive_train() const { return parts_.drive_train; }
  int body_task_body() const {
    return parts_.body_task_body;
  }  ///< body whose orientation the body task controls
  double total_mass() const { return total_mass_; }
  double force_noise() const { return parts_.force_noise; }
  double moment_noise() const { return parts_.moment_noise; }
  const KinematicTree& tree() const { return tree_; }
  /// Joints between the base and `body`, nearest to the body first: the columns its Jacobian may
  /// fill.
  std::span<const int> supporting_joints(int body) const {
    return tree_.supporting_joints[static_cast<size_t>(body)];
  }
  /// The feet that a joint carries: it lies between them and the base.
  FootArray<bool> CarriedFeet(int joint) const;
  /// Every link of the URDF, in order of the names.
  const std::vector<Frame>& frames() const { return parts_.frames; }
  /// A link by its URDF name; null when there is none.
  const Frame* FindFrame(std::string_view name) const;
  /// Index of a joint by name, -1 when there is none.
  int FindJoint(std::string_view name) const;
  /// A copy with one body's mass and inertia scaled and its COM shifted (m, body frame), for
  /// model-error studies. Throws RobotError: no such body, scale not positive, shift not finite.
  RobotModel WithModelError(std::string_view body, double mass_scale,
                            const Eigen::Vector3d& com_shift) const;
  /// A copy whose IMU is turned by `turn`, in its own frame.
  RobotModel WithImuTurned(const Eigen::Matrix3d& turn) const;

 private:
  void BuildTree();

  RobotParts parts_;
  KinematicTree tree_;
  double total_mass_ = 0;
};

/// N·m that a joint gives at most: its effort, or what its motor's peak current gives where that is
/// less.
double PeakTorque(const RobotModel& model, size_t joint);
/// k×1, of each joint.
Eigen::VectorXd PeakTorques(const RobotModel& model);

}  // namespace poise::robot
