// The simulated robot without a bus: a world, drivetrains, terrain, pushes, hands, crane, fall
// detection.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"
#include "sim/crane.h"
#include "sim/current_loop.h"
#include "sim/drivetrain.h"
#include "sim/hand.h"
#include "sim/push.h"
#include "sim/sim.pb.h"
#include "sim/terrain.h"
#include "sim/world.h"

namespace poise {

/// Everything true about the robot at one time. Feet: right first. Always finite.
struct SimulationTruth {
  explicit SimulationTruth(int num_joints);

  robot::RobotState state;
  Eigen::Vector3d com, com_velocity;              ///< m, m/s, world
  robot::FootArray<Eigen::Isometry3d> foot_pose;  ///< of the sole, world
  /// Environment on robot, [force; moment], sole frame: mean over the last step. Before the first:
  /// RestWrenches.
  robot::FootArray<robot::Vector6d> foot_wrench;
  robot::FootArray<int> contact_points;
  Eigen::VectorXd encoder_position;      ///< rad at the joint, where the encoders sit
  Eigen::VectorXd encoder_velocity;      ///< rad/s, likewise
  Eigen::VectorXd motor_current;         ///< A, mean over the last step
  Eigen::VectorXd motor_torque;          ///< N·m at the joint, likewise
  Eigen::VectorXd friction_torque;       ///< N·m on the joint, likewise
  Eigen::Vector3d imu_angular_velocity;  ///< rad/s, IMU frame
  /// m/s², IMU frame: velocity gained over the last control period divided by it, minus gravity. So
  /// no impact is lost, as a real IMU's low-pass loses none.
  Eigen::Vector3d imu_specific_force;
  Eigen::Quaterniond imu_orientation;  ///< IMU to world
  Eigen::Vector3d push_force;          ///< N, world, sum of the pushes and hands at this instant
  Eigen::Vector3d push_point;          ///< m, world, of the strongest of them
  /// The crane's at this instant, all zero without one: where it holds the robot (m, world), its
  /// force on the robot (N, world), and how much of its stiffness is left.
  Eigen::Vector3d crane_point, crane_force;
  double crane_share = 0;
};

/// Deterministic: the same configuration, seed and commands give the same bits. After construction
/// no method allocates (an engine may, inside its step) or throws.
class Simulation {
 public:
  /// `tick_period` (s) must be a whole number of steps; time begins `lead_ticks` before 0. Throws
  /// ConfigError (paths inside SimConfig), and what `worlds` throws.
  Simulation(const robot::RobotModel& model, const SimConfig& config, const WorldFactory& worlds,
             double tick_period, uint64_t seed, int64_t lead_ticks = 0);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Motor currents (A) to follow from now on, rounded to the drives' resolution and limited to the
  /// peak current and the joint's effort if the configuration says so; `enabled` 0: motor free. A
  /// current that is not finite counts as 0 A.
  void SetCurrents(std::span<const double> current, std::span<const int8_t> enabled);
  /// Stiffness and damping that the enabled drives add from now on, by joint, after SetCurrents;
  /// none: nothing. The same limits hold for the sum. One that is not finite, or negative, counts
  /// as nothing.
  void SetImpedance(std::span<const DriveImpedance> impedance);
  /// Once a tick: whether the bridge follows commands, which lets the crane go.
  void Follow(bool follows) {
    if (crane_) crane_->Follow(follows);
  }
  /// Beside the configured pushes: `force` (N, world axes) at `point` (m, body frame) of `body`
  /// from the next step on, until set again for this body; zero takes it away. Indices and numbers
  /// are the caller's to check.
  void SetForce(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& point);
  /// One step of the world.
  void Step();
  /// One tick period.
  void Advance();
  /// Places the robot anew: joints' friction relaxed, compliant gears wound and lagging currents as
  /// they hold it at rest. `state` sized for the model.
  void SetState(const robot::RobotState& state);

  const SimulationTruth& truth() const { return truth_; }
  /// What the sensors see: the truth of sensor_delay ago, but for the push, whose sensor is not the
  /// robot's.
  const SimulationTruth& measured() const { return delayed_.empty() ? truth_ : measured_; }
  double time() const { return static_cast<double>(steps_) * step_; }  ///< s
  double step() const { return step_; }                                ///< s
  /// The simulated robot, model error included.
  const robot::RobotModel& model() const { return model_; }
  bool fallen() const { return fallen_; }
  /// True once the engine complained or the state was no longer finite; the truth then stays at the
  /// last good state.
  bool broken() const { return broken_; }
  /// Why fallen or broken, e.g. "the robot fell at 1.234 s (body tilt 0.83 rad)", or that the crane
  /// holds the robot at time 0; empty otherwise.
  std::string_view end_reason() const { return end_reason_; }

 private:
  void StepOnce();
  /// A that bounds a drive's current; infinite without limits.
  double CurrentLimit(size_t joint) const;
  /// The drive of a joint over the next step: its torque, and what it adds while that is within
  /// limits.
  DriveImpedance Drive(size_t joint, double* torque) const;
  int CollectContacts(robot::Foot foot, bool add);
  void ReadFootWrenches(const robot::FootArray<Eigen::Isometry3d>& sole,
                        const robot::FootArray<Eigen::Vector3d>& com);
  Eigen::Vector3d ImuVelocity() const;
  Eigen::Vector3d PointVelocity(int body, const Eigen::Vector3d& point) const;
  void ReadTruth();
  void ReadPush();
  void ReadCrane();
  void Delay();
  void DetectFall();
  void CheckCrane();
  void Break(std::string_view reason);
  void CheckStart() const;

  robot::RobotModel model_;                // which the world refers to
  std::vector<robot::MotorModel> motors_;  // of the simulated joints
  int steps_per_tick_ = 1;
  double step_ = 0;
  bool torque_limits_;
  double fall_height_, fall_tilt_;
  Terrain terrain_;
  std::unique_ptr<World> world_;
  std::vector<PushProfile> pushes_;
  struct SetForceAt {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, world axes
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< m, body frame
  };
  std::vector<SetForceAt> forces_;  // by body
  std::vector<HandSpring> hands_;
  std::optional<CraneSpring> crane_;
  DriveTrain drive_train_;
  Drivetrain::Options drivetrain_options_;
  std::vector<Drivetrain> drivetrains_;
  CurrentLoop current_loop_;
  robot::FootArray<std::vector<Eigen::Vector3d>> corners_;  // m, body frame
  int64_t steps_ = 0;
  // By joint: A commanded, flowing now, mean of the last step, and N·m of that mean.
  Eigen::VectorXd command_, current_, mean_current_, torque_;
  std::vector<DriveImpedance> impedance_;
  std::vector<char> enabled_;
  std::vector<Eigen::Vector3d> imu_velocity_;  // m/s, world, by step, a ring of a control period
  size_t imu_step_ = 0;                        // the newest of them
  Eigen::Vector3d imu_acceleration_ = Eigen::Vector3d::Zero();  // m/s², mean over that period
  SimulationTruth truth_, measured_;
  std::vector<SimulationTruth> delayed_;  // by step, a ring of sensor_delay
  size_t oldest_ = 0;
  double start_com_height_ = 0;
  bool fallen_ = false, broken_ = false;
  char end_reason_[200] = "";
};

}  // namespace poise
