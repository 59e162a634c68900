// A robot moved along a scripted base and foot motion by inverse kinematics, and exact or noisy
// readings of its sensors: the truth that an estimate is compared with.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <string>

#include "components/robot/dynamics.h"
#include "components/state_estimator/base_sensors.h"
#include "tests/test_seed.h"

namespace poise {

/// What moves, as functions of time: base pose and feet in the world, the load of each foot as a
/// share of the weight.
struct MotionScript {
  std::function<Eigen::Vector3d(double)> base_position;
  std::function<Eigen::Quaterniond(double)> base_orientation;
  std::array<std::function<Eigen::Isometry3d(double)>, 2> foot;
  std::array<std::function<double(double)>, 2> load;
  /// Joints that carry no foot, all by the same angle: rad.
  std::function<double(double)> other_joints = [](double) { return 0.0; };
};

/// Standard deviations and constant biases; all zero: exact readings.
struct SensorErrors {
  double gyro_noise = 0, accelerometer_noise = 0, load_noise = 0;  // rad/s, m/s², N
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();             // rad/s
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();    // m/s²
  bool encoder_steps = false;  // positions rounded to encoder counts
};

/// Noise and bias of the paper's robot's file.
SensorErrors TypicalErrors(const robot::RobotModel& model);

class BaseMotion {
 public:
  /// `path`: Robot file. The start is a standing posture with bent knees, soles flat on z = 0,
  /// their midpoint at the origin; the script's default stands still in it, both feet loaded
  /// evenly.
  explicit BaseMotion(const std::string& path);

  std::shared_ptr<const robot::RobotModel> model() const { return model_; }
  const robot::RobotState& start() const { return start_; }
  /// Default: standing still.
  MotionScript& script() { return script_; }
  SensorErrors& errors() { return errors_; }

  /// Moves on to the next sample, kPeriod later (the first: time 0).
  void Next();
  double time() const { return kPeriod * static_cast<double>(sample_); }
  const robot::RobotState& truth() const { return now_; }
  Eigen::Vector3d com() const;
  /// Readings at the present sample; valid until the next.
  BaseSensors sensors();

  static constexpr double kPeriod = 0.002;

 private:
  static constexpr double kGrid = kPeriod / 2;

  struct Sample {
    robot::RobotState state;
    Eigen::Vector3d imu_position;
    Eigen::Matrix3d imu_rotation;
  };
  Sample Solve(double time, const Eigen::VectorXd& guess);

  std::shared_ptr<const robot::RobotModel> model_;
  robot::RobotData data_;
  robot::RobotState start_, now_;
  std::array<std::vector<int>, 2> leg_;  // joints of each leg
  MotionScript script_;
  SensorErrors errors_;
  std::mt19937_64 random_{TestSeed(1)};
  Sample before_, at_, after_;  // one grid step apart
  int64_t sample_ = -1;
  Eigen::VectorXd reading_;
};

/// 0 before `start`, 1 after `end`, no jump of acceleration between.
double Ramp(double t, double start, double end);

/// Sway, bob and turn of the body above standing feet, gently begun; `amplitude` m.
void Sway(BaseMotion* motion, double amplitude);

/// The robot shifts its weight to the right foot, puts the left foot forward and up, and loads it.
void StepUp(BaseMotion* motion);

/// A finite number as broken sensors may give: huge, denormal, zero or of ordinary size.
double AnyFinite(std::mt19937_64* random);

/// rad, angle between the estimated and the true vertical.
double TiltError(const Eigen::Quaterniond& estimate, const Eigen::Quaterniond& truth);

}  // namespace poise
