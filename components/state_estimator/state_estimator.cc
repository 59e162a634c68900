#include "components/state_estimator/state_estimator.h"

#include <algorithm>

#include "components/balance/gains/gain_rule.h"
#include "components/framework/run.h"
#include "components/messages/conversions.h"
#include "components/messages/robot_resource.h"
#include "components/state_estimator/state_estimator.pb.h"
#include "poise/drive_feedback_t.hpp"

namespace poise {

std::string_view state_estimator_proto_schema();  // generated
namespace {

using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

void CheckConfig(StateEstimatorConfig config, const robot::RobotModel& model) {
  if (config.invariant_ekf().has_sensor_delay()) return;
  config.mutable_invariant_ekf()->set_sensor_delay(model.drive_train().sensor_delay);
  try {
    CheckFields(config);
  } catch (const ConfigError& error) {
    throw ConfigError(error.field(), error.problem() + ", and it is the robot file's");
  }
}

FootReading ReadFoot(const robot_sensors_t& sensors, Foot foot) {
  FootReading reading;
  if (sensors.foot_sensor[Index(foot)] == drive_feedback_t::SENSOR_ABSENT) {
    reading.state = FootSensorCheck::State::kAbsent;
  } else if (sensors.foot_sensor[Index(foot)] != drive_feedback_t::SENSOR_OK) {
    reading.state = FootSensorCheck::State::kInvalid;
  }
  reading.wrench = GetWrench(sensors.foot_wrench[Index(foot)]);
  return reading;
}

constexpr double kLeastForce = 1;  // N: below it a sole has no centre of pressure

// The sensor reads what the robot does to the ground; the signs cancel.
Eigen::Vector2d CenterOfPressure(const robot::Vector6d& wrench) {
  if (!(wrench[2] < -kLeastForce)) return Eigen::Vector2d::Zero();
  return {-wrench[4] / wrench[2], wrench[3] / wrench[2]};
}

}  // namespace

void StateEstimator::Configure(const ComponentContext& context, Wiring* wiring) {
  auto config = context.config<StateEstimatorConfig>();
  const std::shared_ptr<const robot::RobotModel> model = LoadRobot(context);
  if (!config.has_joint_velocity_cutoff()) {
    config.set_joint_velocity_cutoff(config.steps() ? balance::StepCutoff(*model)
                                                    : balance::VelocityCutoff(*model));
  }
  CheckConfig(config, *model);
  wrenches_ = std::make_unique<FootWrenches>(model);
  calibrator_ =
      std::make_unique<Calibrator>(model, config.calibration().enabled(), context.tick_period);
  const MessageCounts counts = JointAndFootCounts(*model);
  wiring->AddInput(&robot_sensors_, "robot_sensors", counts);
  wiring->AddOutput(&robot_state_, "robot_state", counts);
  wiring->AddOutput(&estimator_status_, "estimator_status", {static_cast<int>(counts[1])});
  wiring->AddStage("estimate", {&robot_sensors_}, {&robot_state_, &estimator_status_},
                   [this](const Tick& tick) { Estimate(tick); });
  last_time_ = MakeTick(0, context.tick_period, context.lead_ticks).time;
  base_ = std::make_unique<InvariantEstimator>(model, config, context.tick_period);
  estimator_status_->method = estimator_status_t::METHOD_INVARIANT_EKF;
  estimator_status_->has_covariance = 1;
}

bool StateEstimator::Archive(StateArchive* archive) {
  archive->Show(last_time_);
  wrenches_->Archive(archive);
  calibrator_->Archive(archive);
  base_->Archive(archive);
  return true;
}

void StateEstimator::Estimate(const Tick& tick) {
  const robot_sensors_t& in = *robot_sensors_;
  BaseSensors sensors = {
      {in.joint_position.data(), in.num_joints},
      Vector3d(in.imu_angular_velocity),
      Vector3d(in.imu_acceleration),
      {},
      {},
      {in.joint_torque.data(), in.num_joints},
  };
  const double dt = tick.time - last_time_;
  last_time_ = tick.time;
  wrenches_->Update(tick.index, dt, sensors,
                    {ReadFoot(in, Foot::kRight), ReadFoot(in, Foot::kLeft)}, Correction());
  for (const Foot f : kFeet) {
    sensors.foot_load[f] = -wrenches_->wrench(f)[2];
    sensors.foot_cop[f] = CenterOfPressure(wrenches_->wrench(f));
  }
  if (calibrator_->enabled()) {
    calibrator_->Track({wrenches_->wrench(Foot::kRight), wrenches_->wrench(Foot::kLeft)}, dt);
    if (wrenches_->observed()) {
      calibrator_->Update(wrenches_->observer(), std::ranges::all_of(kFeet, [this](Foot f) {
                            return wrenches_->measured(f);
                          }));
    }
  }
  base_->Update(sensors, dt);
  PublishBase();
  PublishWrenches();
  if (calibrator_->enabled()) PublishCalibration();
}

// What the estimator knows of the IMU's errors by now.
ObserverCorrection StateEstimator::Correction() const {
  ObserverCorrection correction;
  correction.gyro_bias = base_->filter().state().gyro_bias;
  correction.accelerometer_bias = base_->filter().state().accelerometer_bias;
  correction.load_mass = calibrator_->load()[0];
  correction.load_moment = calibrator_->load().tail<3>();
  return correction;
}

void StateEstimator::PublishWrenches() {
  robot_state_t& out = *robot_state_;
  for (const Foot f : kFeet) {
    const size_t i = Index(f);
    SetWrench(wrenches_->wrench(f), &out.foot_wrench[i]);
    SetWrench(wrenches_->deviation(f), &out.foot_wrench_deviation[i]);
    out.foot_wrench_source[i] =
        wrenches_->measured(f) ? robot_state_t::SOURCE_SENSOR : robot_state_t::SOURCE_OBSERVER;
    estimator_status_->foot_sensor[i] = static_cast<int8_t>(wrenches_->check(f).state());
  }
  estimator_status_t& status = *estimator_status_;
  const WrenchObserver& observer = wrenches_->observer();
  status.has_observer = observer.torque_known() ? 1 : 0;
  status.push_excess = observer.push_excess();
  for (const Foot f : kFeet) {
    SetWrench(observer.wrenches().segment<6>(6 * static_cast<Eigen::Index>(f)),
              &status.observed_wrench[Index(f)]);
  }
  size_t next = 0;
  for (int row = 0; row < 12; ++row) {
    for (int column = row; column < 12; ++column) {
      status.observed_covariance[next++] = observer.covariance()(row, column);
    }
  }
}

// The IMU's tilt is what its accelerometer's bias looks like: standing tells only both together.
void StateEstimator::PublishCalibration() {
  const Calibrator::Load& load = calibrator_->load();
  robot_state_->load_mass = load[0];
  SetVector3(load.tail<3>(), robot_state_->load_moment);
  estimator_status_t& status = *estimator_status_;
  status.calibration = calibrator_->running() ? estimator_status_t::CALIBRATION_RUNNING
                                              : estimator_status_t::CALIBRATION_WAITING;
  status.load_mass = calibrator_->estimate()[0];
  SetVector3(calibrator_->estimate().tail<3>(), status.load_moment);
  // Turned by (roll, pitch) an IMU at rest reads (−g pitch, g roll, g).
  const Vector3d bias = Correction().accelerometer_bias;
  status.imu_tilt[0] = bias.y() / robot::kGravity;
  status.imu_tilt[1] = -bias.x() / robot::kGravity;
  const Eigen::Matrix4d& covariance = calibrator_->covariance();
  size_t next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column, ++next) {
      status.calibration_covariance[next] = column < 4 ? covariance(row, column) : 0;
    }
  }
}

void StateEstimator::PublishBase() {
  const robot::RobotState& state = base_->state();
  robot_state_t& out = *robot_state_;
  SetVector3(state.base_position, out.base_position);
  SetQuaternion(state.base_orientation, out.base_orientation);
  SetVector3(state.base_linear_velocity, out.base_linear_velocity);
  SetVector3(state.base_angular_velocity, out.base_angular_velocity);
  std::copy_n(state.joint_position.data(), state.joint_position.size(), out.joint_position.data());
  std::copy_n(state.joint_velocity.data(), state.joint_velocity.size(), out.joint_velocity.data());
  std::ranges::copy(base_->foot_weight(), out.foot_load_share.begin());
  const InvariantState& biases = base_->filter().state();
  SetVector3(biases.gyro_bias, out.imu_bias_angular_velocity);
  estimator_status_t& status = *estimator_status_;
  SetVector3(biases.gyro_bias, status.imu_bias_angular_velocity);
  SetVector3(biases.accelerometer_bias, status.imu_bias_acceleration);
  const InvariantEstimator::BaseCovariance& covariance = base_->covariance();
  size_t next = 0;
  for (int row = 0; row < 9; ++row) {
    for (int column = row; column < 9; ++column) {
      status.covariance[next++] = covariance(row, column);
    }
  }
  for (const Foot f : kFeet) {
    const size_t i = Index(f);
    status.foot_contact[i] = static_cast<int8_t>(base_->contact(f));
    status.foot_innovation[i] = base_->innovation(f);
    SetPose(base_->foot_pose(f), &status.foot_pose[i]);
  }
}

ComponentType StateEstimatorType() {
  return {"state_estimator",
          "floating base and joint velocities from IMU, encoders and feet",
          [] { return std::make_unique<StateEstimator>(); },
          // An ideal drive train has no delay and no gears that give.
          {.ideal = {"state_estimator.invariant_ekf.sensor_delay=0",
                     "state_estimator.invariant_ekf.gear_stiffness=0"}},
          {Reads<robot_sensors_t>("robot_sensors"), Writes<robot_state_t>("robot_state"),
           Writes<estimator_status_t>("estimator_status")},
          StateEstimatorConfig::descriptor(),
          state_estimator_proto_schema};
}

}  // namespace poise
