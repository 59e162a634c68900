#include "components/state_estimator/invariant_estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/robot/sole.h"
#include "components/state_estimator/square.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

constexpr double kLongestPrediction = 1;  // s: what lies further back is not extrapolated
constexpr double kMaxJointRate = 100;     // rad/s: no joint is faster
constexpr double kMaxTorque = 1e4;        // N·m: no motor gives more
// Beyond the ranges of the IMUs that robots carry (2000 deg/s, 16 g) a reading is a fault; the last
// good one then stands in for it with this uncertainty.
constexpr double kGyroRange = 35, kGyroFault = 10;                     // rad/s
constexpr double kAccelerometerRange = 160, kAccelerometerFault = 50;  // m/s²
// An encoder of unknown resolution.
constexpr double kUnknownEncoder = 1e-5;  // rad
// Standard deviations of a good MEMS IMU, which the robot file's may exceed: noise per sample, and
// biases at the start.
constexpr double kLeastGyroNoise = 1e-4, kLeastGyroBias = 1e-3;                   // rad/s
constexpr double kLeastAccelerometerNoise = 1e-2, kLeastAccelerometerBias = 0.1;  // m/s²
// Random walk of its biases, an in-run instability over minutes: rad/s/√s, m/s²/√s.
constexpr double kGyroBiasWalk = 1e-6, kAccelerometerBiasWalk = 1e-4;
// s, by which encoders and IMU are not sampled at the same instant: a quarter of a 500 Hz cycle.
constexpr double kTiming = 0.0005;
// Share of 1/gear_stiffness, standard deviation of the gears' compliance at first: a data sheet's.
constexpr double kComplianceError = 0.2;
// Shares of the compliance that is assumed: no estimate is taken further.
constexpr double kLeastCompliance = 0.1, kMostCompliance = 10;
// s, over which innovations larger than their covariance are averaged.
constexpr double kExcessTime = 0.05;
// m between the soles: below it they do not show the heading.
constexpr double kLeastStance = 0.02;
// How far off the base may be before the ground defines the world, which leaves nothing of it: rad,
// m.
constexpr double kUnplacedTurn = 0.1, kUnplaced = 0.1;
// The robot stands still at first, as far as feet and IMU can move against each other unseen.
constexpr double kStartSpeed = 0.01;  // m/s
// N·m by which the first torque readings may differ from what the gears carry, as after switching
// drives on; until they have settled.
constexpr double kStartTorque = 30;
// rad/√s, walk of the rotation of a sole that stands, for the same reason as contact_walk.
constexpr double kTurnWalk = 4e-5;
// m/s and rad/s of a sole that slips or sinks, and of one that turns.
constexpr double kSlipSpeed = 0.3, kTurnSpeed = 1;
// Squared normalised innovation (chi-squared, 3 degrees of freedom) beyond which a sole moves: one
// tick in 65,000.
constexpr double kSlipGate = 25;
// s in which a sole that slipped must have moved by less than so many m, turned by less than so
// many rad, to stand again.
constexpr double kRestTime = 0.05, kRestDistance = 1e-4, kRestTurn = 2e-4;
// s, in which the ringing of a gear dies away: rotor and link of a tenth of a kg·m² on a harmonic
// drive, damped by a twentieth of critical.
constexpr double kRinging = 0.03;
// A foot that has not come to rest for this long with no other to stand on is the world.
constexpr double kLongestSlip = 0.5;  // s
// Two soles that carry the robot and do not go past each other faster than this are the world, too:
// what moves both alike is an error of the base's estimate, as a blow leaves it that the
// accelerometer has not seen.
constexpr double kTogether = 0.02;  // m/s
// Beyond these nothing is known of the base: in flight, or on a hoist, for minutes.
constexpr double kLostTilt = 0.5, kLostSpeed = 10;  // rad, m/s, standard deviations
constexpr double kRecoverTilt = 0.1, kRecoverSpeed = 1, kRecoverPosition = 1;

/// What nobody gave is the robot's.
InvariantEkfConfig WithRobot(InvariantEkfConfig config, const robot::RobotModel& model) {
  const robot::DriveTrainModel& drive = model.drive_train();
  if (!config.has_sensor_delay()) config.set_sensor_delay(drive.sensor_delay);
  if (!config.has_gear_stiffness()) {
    config.set_gear_stiffness(drive.link_encoder ? 0
                                                 : drive.gear_stiffness);  // the encoders see it
  }
  return config;
}

}  // namespace

InvariantEstimator::InvariantEstimator(std::shared_ptr<const robot::RobotModel> model,
                                       const StateEstimatorConfig& config, double period)
    : model_(std::move(model)),
      config_(WithRobot(config.invariant_ekf(), *model_)),
      gyro_noise_(std::max(kLeastGyroNoise, model_->imu().gyro_noise)),
      accelerometer_noise_(std::max(kLeastAccelerometerNoise, model_->imu().accelerometer_noise)),
      period_(period),
      weight_(model_->total_mass() * robot::kGravity),
      encoder_noise_(model_->num_joints()),
      torque_(Eigen::VectorXd::Zero(model_->num_joints())),
      unrest_(Eigen::VectorXd::Zero(model_->num_joints())),
      velocity_filter_(model_->num_joints(), config.joint_velocity_cutoff()),
      kinematics_(model_),
      filter_(robot::kGravity),
      joint_position_(Eigen::VectorXd::Zero(model_->num_joints())),
      link_position_(Eigen::VectorXd::Zero(model_->num_joints())),
      joint_rate_(Eigen::VectorXd::Zero(model_->num_joints())),
      state_(model_->num_joints()) {
  for (int j = 0; j < model_->num_joints(); ++j) {
    const robot::MotorModel& motor = model_->motors()[static_cast<size_t>(j)];
    const double counts = motor.gear_ratio * motor.encoder_counts;
    const double rounding =
        counts > 0 ? 2 * std::numbers::pi / counts / std::sqrt(12.0) : kUnknownEncoder;
    encoder_noise_[j] = rounding;
  }
}

void InvariantEstimator::Update(const BaseSensors& sensors, double dt) {
  dt = std::clamp(dt, 0.1 * period_, std::max(kLongestPrediction, period_));
  ReadJoints(sensors, dt);
  ReadImu(sensors);
  kinematics_.Update(link_position_, velocity_filter_.value());
  if (!placed_) {
    Place(sensors);
    placed_ = true;
  } else {
    Propagate(dt);
    UpdateContacts(sensors);
    Correct(dt);
  }
  Publish();
  last_gyro_ = gyro_;
  last_force_ = force_;
  last_imu_good_ = imu_good_;
}

void InvariantEstimator::ReadJoints(const BaseSensors& sensors, double dt) {
  if (placed_) {
    joint_rate_ = ((sensors.joint_position - joint_position_) / dt)
                      .cwiseMin(kMaxJointRate)
                      .cwiseMax(-kMaxJointRate);
    velocity_filter_.Step(joint_rate_, dt);
  }
  joint_position_ = sensors.joint_position;
  link_position_ = sensors.joint_position;
  if (!(config_.gear_stiffness() > 0) || sensors.joint_torque.size() != torque_.size()) return;
  const double compliance =
      std::clamp(1 + filter_.state().compliance, kLeastCompliance, kMostCompliance);
  // What has just changed of the torque first moves the rotor, and then rings.
  unrest_ *= std::exp(-dt / kRinging);
  for (int j = 0; j < torque_.size(); ++j) {
    const double torque = std::clamp(sensors.joint_torque[j], -kMaxTorque, kMaxTorque);
    if (placed_) unrest_[j] = std::max(unrest_[j], std::abs(torque - torque_[j]));
    torque_[j] = torque;
    link_position_[j] -= compliance * torque / config_.gear_stiffness();
  }
}

void InvariantEstimator::ReadImu(const BaseSensors& sensors) {
  const auto within = [](const Vector3d& v, double range) {
    return v.cwiseAbs().maxCoeff() <= range;  // false for what is not a number
  };
  imu_good_ = within(sensors.angular_velocity, kGyroRange) &&
              within(sensors.acceleration, kAccelerometerRange);
  if (imu_good_) {
    gyro_ = sensors.angular_velocity;
    force_ = sensors.acceleration;
  }
}

// Encoders' and gears' errors through the joints, and the timing of the readings through the
// motion.
void InvariantEstimator::ReadSoles() {
  const Matrix3d base = filter_.state().rotation * kinematics_.imu_rotation().transpose();
  for (const Foot f : kFeet) {
    const Sole& sole = kinematics_.sole(f);
    SoleReading& reading = feet_[f].reading;
    reading.position =
        kinematics_.imu_rotation().transpose() * (sole.position - kinematics_.imu_position());
    reading.rotation = kinematics_.imu_rotation().transpose() * sole.rotation;
    // Covariances in world axes: of position, of rotation by position, of rotation.
    Matrix3d linear = Matrix3d::Zero(), mixed = linear, angular = linear;
    const auto add_noise = [&](double variance, const Vector3d& shift, const Vector3d& turn) {
      for (int i = 0; i < 3; ++i) {
        const double by_shift = variance * shift[i], by_turn = variance * turn[i];
        linear.col(i) += by_shift * shift;
        mixed.col(i) += by_shift * turn;
        angular.col(i) += by_turn * turn;
      }
    };
    Vector3d speed = Vector3d::Zero(), rate = speed, lag = speed, lean = speed;
    for (const int j : kinematics_.joints(f)) {
      const robot::Vector6d column = kinematics_.RelativeColumn(f, j);
      const Vector3d shift = base * column.head<3>(), turn = base * column.tail<3>();
      double variance = Square(encoder_noise_[j]);
      if (config_.gear_stiffness() > 0) {
        // A gear that rings errs in one way for kRinging: white noise must be so much larger to
        // tell as little.
        variance += kRinging / period_ * Square(unrest_[j] / config_.gear_stiffness());
        const double windup = torque_[j] / config_.gear_stiffness();
        lag -= windup * shift;
        lean -= windup * turn;
      }
      add_noise(variance, shift, turn);
      speed += velocity_filter_.value()[j] * shift;
      rate += velocity_filter_.value()[j] * turn;
    }
    add_noise(Square(kTiming), speed, rate);
    reading.noise << linear, mixed.transpose(), mixed, angular;
    reading.compliance = filter_.state().compliance;
    reading.by_compliance << lag, lean;
  }
}

void InvariantEstimator::Begin(const InvariantState& state, double turn, double speed,
                               double position) {
  InvariantFilter::Error deviation = InvariantFilter::Error::Zero();
  deviation.segment<3>(InvariantFilter::kRotation).setConstant(turn);
  deviation.segment<3>(InvariantFilter::kVelocity).setConstant(speed);
  deviation.segment<3>(InvariantFilter::kPosition).setConstant(position);
  deviation.segment<3>(InvariantFilter::kGyroBias)
      .setConstant(std::max(kLeastGyroBias, model_->imu().gyro_bias));
  deviation.segment<3>(InvariantFilter::kAccelerometerBias)
      .setConstant(std::max(kLeastAccelerometerBias, model_->imu().accelerometer_bias));
  deviation[InvariantFilter::kCompliance] = kComplianceError;
  filter_.Set(state, deviation.cwiseAbs2().asDiagonal());
}

void InvariantEstimator::Place(const BaseSensors& sensors) {
  const FootWeights weights = WeighFeet(sensors.foot_load, weight_);
  const Placement placement = PlaceOnGround(kinematics_, weights);
  InvariantState state;
  state.rotation = Orthonormal(placement.orientation * kinematics_.imu_rotation());
  state.position = placement.position + placement.orientation * kinematics_.imu_position();
  Begin(state, kUnplacedTurn, kStartSpeed, kUnplaced);
  for (const Foot f : kFeet) {
    if (!(weights.grip[f] > 0)) continue;  // a leg that hangs carries little
    for (const int j : kinematics_.joints(f)) unrest_[j] = kStartTorque;
  }
  UpdateContacts(sensors);
  for (const Foot f : kFeet) {
    FootState& foot = feet_[f];
    if (foot.loaded && !filter_.holds_rotation(f)) filter_.HoldRotation(f, foot.reading);
    foot.slip_left = foot.turn_left = 0;  // at rest
  }
  DefineWorld(weights);
}

// The soles are where the ground is, as PlaceOnGround put them: level on average, at the height 0,
// about the origin, along y. What is not known of joints and gears is thus the base's.
void InvariantEstimator::DefineWorld(const FootWeights& weights) {
  using Row = InvariantFilter::Error;
  const auto row = [](int first, int axis) { return Row(Row::Unit(first + axis)); };
  robot::FootArray<double> share;
  for (const Foot f : kFeet) {
    if (feet_[f].loaded) share[f] = weights.share[f];
  }
  const double sum = share[Foot::kRight] + share[Foot::kLeft];
  if (!(sum > 0)) {  // on a hoist
    for (int axis = 0; axis < 3; ++axis) {
      filter_.Know(row(InvariantFilter::kRotation, axis),
                   axis < 2 ? config_.start_tilt() : config_.start_yaw());
      filter_.Know(row(InvariantFilter::kPosition, axis), config_.start_position());
    }
    return;
  }
  // Right and left sole, weighted, tell where they are, d̂ − d = ξ_d + ξ_R × d, a sole that is not
  // held as the joints show it, and how they are turned.
  const auto moved = [&](int axis, double right, double left, double deviation) {
    Row h = Row::Zero();
    double variance = Square(deviation);
    for (const Foot f : kFeet) {
      const double weight = f == Foot::kRight ? right : left;
      const SoleReading& reading = feet_[f].reading;
      const bool held = filter_.holds_position(f);
      const int place =
          held ? InvariantFilter::kFoot + 3 * static_cast<int>(f) : InvariantFilter::kPosition;
      h[place + axis] += weight;
      h.segment<3>(InvariantFilter::kRotation) -=
          weight * Skew(filter_.SeenPosition(reading)).row(axis).transpose();
      if (!held) {
        h[InvariantFilter::kCompliance] += weight * reading.by_compliance[axis];
        variance += Square(weight) * reading.noise(axis, axis);
      }
    }
    filter_.Know(h, std::sqrt(variance));
  };
  const auto turned = [&](int axis, double right, double left, double deviation) {
    const Row h = right * row(InvariantFilter::kFootRotation, axis) +
                  left * row(InvariantFilter::kFootRotation + 3, axis);
    filter_.Know(h, deviation);
  };
  const double right = share[Foot::kRight] / sum, left = share[Foot::kLeft] / sum;
  for (int axis = 0; axis < 2; ++axis) {
    turned(axis, right, left, config_.start_tilt());
    moved(axis, 0.5, 0.5, config_.start_position());
  }
  moved(2, right, left, config_.start_position());
  const double apart = filter_.SeenPosition(feet_[Foot::kLeft].reading).y() -
                       filter_.SeenPosition(feet_[Foot::kRight].reading).y();
  if (apart > kLeastStance) {
    moved(0, -1 / apart, 1 / apart, config_.start_yaw());
  } else {
    turned(2, right, left, config_.start_yaw());
  }
}

void InvariantEstimator::Propagate(double dt) {
  const Vector3d turn = gyro_ - last_gyro_, push = force_ - last_force_;
  ImuStep imu;
  imu.angular_velocity = 0.5 * (last_gyro_ + gyro_);
  imu.acceleration = 0.5 * (last_force_ + force_);
  // A step at an unknown instant between two readings: uniform over their difference.
  imu.angular_velocity_noise =
      Square(gyro_noise_) * Matrix3d::Identity() + turn * turn.transpose() / 12;
  imu.acceleration_noise =
      Square(accelerometer_noise_) * Matrix3d::Identity() + push * push.transpose() / 12;
  if (!imu_good_ || !last_imu_good_) {
    imu.angular_velocity_noise += Square(kGyroFault) * Matrix3d::Identity();
    imu.acceleration_noise += Square(kAccelerometerFault) * Matrix3d::Identity();
  }
  imu.gyro_bias_walk = kGyroBiasWalk;
  imu.accelerometer_bias_walk = kAccelerometerBiasWalk;
  filter_.Propagate(imu, dt);

  const InvariantFilter::Covariance& c = filter_.covariance();
  // A sum of zeros, unless one of them is not finite.
  const bool finite = filter_.state().position.allFinite() &&
                      filter_.state().velocity.allFinite() && (0 * c).sum() == 0;
  const auto worst = [&](int row) { return c.diagonal().segment<3>(row).maxCoeff(); };
  if (!finite || worst(InvariantFilter::kRotation) > Square(kLostTilt) ||
      worst(InvariantFilter::kVelocity) > Square(kLostSpeed)) {
    Recover(finite);
  }
  for (const Foot f : kFeet) {
    const FootState& foot = feet_[f];
    filter_.Loosen(
        f, foot.slip_left > 0 ? Square(kSlipSpeed * dt) : Square(config_.contact_walk()) * dt,
        foot.turn_left > 0 ? Square(kTurnSpeed * dt) : Square(kTurnWalk) * dt);
  }
}

// Starts the filter again where it is, as one that knows little.
void InvariantEstimator::Recover(bool finite) {
  InvariantState state = filter_.state();
  if (!finite) state = InvariantState();
  state.velocity.setZero();
  Begin(state, kRecoverTilt, kRecoverSpeed, kRecoverPosition);
}

void InvariantEstimator::UpdateContacts(const BaseSensors& sensors) {
  const FootWeights weights = WeighFeet(sensors.foot_load, weight_);
  ReadSoles();
  for (const Foot f : kFeet) {
    FootState& foot = feet_[f];
    foot_weight_[f] = weights.standing * weights.share[f];
    foot.loaded = foot.loaded ? weights.grip[f] > 0 : weights.grip[f] >= 1;
    if (!foot.loaded) {
      filter_.ReleasePosition(f);
      filter_.ReleaseRotation(f);
      foot.slip_left = foot.turn_left = 0;
      foot.innovation = 0;
      foot.excess = 1;
      continue;
    }
    if (!filter_.holds_position(f)) {
      filter_.HoldPosition(f, foot.reading);
      LetSlip(f);  // it has yet to settle
    }
    const double inside = robot::DistanceInside(model_->feet()[f], sensors.foot_cop[f]);
    if (filter_.holds_rotation(f)) {
      if (!(inside > 0.5 * config_.cop_margin())) filter_.ReleaseRotation(f);
    } else if (inside > config_.cop_margin()) {
      filter_.HoldRotation(f, foot.reading);
      LetTurn(f);
    }
  }
}

void InvariantEstimator::LetSlip(Foot foot) {
  feet_[foot].slip_left = kRestTime;
  feet_[foot].slip_time = 0;
  BeginRest(foot);
}

void InvariantEstimator::BeginRest(Foot foot) {
  feet_[foot].slip_start = filter_.SeenPosition(feet_[foot].reading);
  feet_[foot].apart_start = Apart(foot);
}

Eigen::Vector3d InvariantEstimator::Apart(Foot foot) const {
  return filter_.SeenPosition(feet_[Other(foot)].reading) -
         filter_.SeenPosition(feet_[foot].reading);
}

void InvariantEstimator::LetTurn(Foot foot) {
  feet_[foot].turn_left = kRestTime;
  feet_[foot].turn_start = filter_.SeenRotation(feet_[foot].reading);
}

void InvariantEstimator::Correct(double dt) {
  // How far each foot is off, if it stands still. One that slips may be off.
  robot::FootArray<bool> moved;
  int firm = 0;
  for (const Foot f : kFeet) {
    FootState& foot = feet_[f];
    if (!foot.loaded) continue;
    const double scale = std::max(1.0, foot.excess);
    foot.reading.noise *= scale;
    const InvariantFilter::Innovation test = filter_.Test(f, foot.reading);
    foot.innovation = test.position;
    moved[f] = (foot.slip_left <= 0 && test.position > kSlipGate) ||
               (foot.turn_left <= 0 && test.rotation > kSlipGate);
    firm += foot.slip_left <= 0 ? 1 : 0;
    if (!moved[f]) {
      const double shown = scale * std::max(test.position, test.rotation) / 3;  // 3: its mean
      foot.excess += std::min(dt / kExcessTime, 1.0) * (shown - foot.excess);
    }
  }
  // Feet that stand still first: they tell whether the others do.
  for (const bool after : {false, true}) {
    for (const Foot f : kFeet) {
      FootState& foot = feet_[f];
      if (!foot.loaded || moved[f] != after) continue;
      if (moved[f]) {
        const InvariantFilter::Innovation test = filter_.Test(f, foot.reading);
        if (foot.slip_left <= 0 && test.position > kSlipGate) {
          LetSlip(f);
          filter_.Loosen(f, Square(kSlipSpeed * dt), 0);
        }
        if (foot.turn_left <= 0 && test.rotation > kSlipGate) {
          LetTurn(f);
          filter_.Loosen(f, 0, Square(kTurnSpeed * dt));
        }
      }
      filter_.Correct(f, foot.reading);
    }
  }
  for (const Foot f : kFeet) {
    if (feet_[f].loaded) ComeToRest(f, firm > 0, dt);
  }
}

// A sole has come to rest when it has hardly moved for kRestTime.
void InvariantEstimator::ComeToRest(Foot f, bool other_stands, double dt) {
  FootState& foot = feet_[f];
  if (foot.slip_left > 0) {
    foot.slip_left -= dt;
    foot.slip_time += dt;
    if (foot.slip_left <= 0) {
      // It may be the base that moves, by as much as is not known of its velocity.
      const double way = (filter_.SeenPosition(feet_[f].reading) - foot.slip_start).norm();
      const double speed =
          std::sqrt(filter_.covariance().diagonal().segment<3>(InvariantFilter::kVelocity).sum());
      const bool together =
          feet_[Other(f)].loaded && (Apart(f) - foot.apart_start).norm() < kTogether * kRestTime;
      if (!other_stands && (together || foot.slip_time > kLongestSlip)) {
        // The foot is the world then, and the base's velocity is what is wrong.
        filter_.Doubt(0, Square(way / kRestTime), 0);
      } else if (way > kRestDistance + 3 * speed * kRestTime) {
        foot.slip_left = kRestTime;
        BeginRest(f);
      }
    }
  }
  if (foot.turn_left > 0) {
    foot.turn_left -= dt;
    const double turn =
        RotationLog(filter_.SeenRotation(feet_[f].reading) * foot.turn_start.transpose()).norm();
    if (foot.turn_left <= 0 && turn > kRestTurn) LetTurn(f);
  }
}

void InvariantEstimator::Publish() {
  const InvariantState& s = filter_.state();
  const double d = config_.sensor_delay();
  const Matrix3d to_base = kinematics_.imu_rotation();
  const Matrix3d base = s.rotation * to_base.transpose();
  const Vector3d rate =
      base * (to_base * (gyro_ - s.gyro_bias) - kinematics_.imu_angular_velocity());
  const Vector3d lever = base * kinematics_.imu_position();  // from the base to the IMU
  const Vector3d velocity = s.velocity - rate.cross(lever) - base * kinematics_.imu_velocity();
  const Vector3d position = s.position - lever;
  const Vector3d force = s.rotation * (force_ - s.accelerometer_bias);
  const Vector3d acceleration = force - robot::kGravity * Vector3d::UnitZ();

  const Matrix3d turned = RotationExp(d * rate) * base;
  state_.base_orientation = Quaterniond(turned).normalized();
  state_.base_angular_velocity = rate;
  state_.base_linear_velocity = velocity + d * acceleration;
  state_.base_position = position + d * velocity + 0.5 * d * d * acceleration;

  state_.joint_velocity = velocity_filter_.value();
  state_.joint_position = joint_position_ + d * state_.joint_velocity;

  // Errors of (orientation, velocity, position) by those of ξ's rotation, velocity, position and of
  // both biases: J P Jᵀ, J block by block.
  const Matrix3d& r = s.rotation;
  const Matrix3d v_turn = -Skew(velocity + d * force);
  const Matrix3d p_turn = -Skew(position + d * velocity + 0.5 * d * d * force);
  const Matrix3d v_gyro = -Skew(lever) * r;
  const auto times_jacobian_transposed = [&](const auto& m, auto* out) {
    const auto times = [&m](int first, const Matrix3d& block, int row) {
      return block(row, 0) * m.col(first) + block(row, 1) * m.col(first + 1) +
             block(row, 2) * m.col(first + 2);
    };
    for (int i = 0; i < 3; ++i) {
      out->col(i) = m.col(i) - d * times(9, r, i);
      out->col(3 + i) =
          m.col(3 + i) + times(0, v_turn, i) + times(9, v_gyro, i) - d * times(12, r, i);
      out->col(6 + i) = m.col(6 + i) + d * m.col(3 + i) + times(0, p_turn, i) +
                        d * times(9, v_gyro, i) - 0.5 * d * d * times(12, r, i);
    }
  };
  // Rows are filled up to whole registers.
  const InvariantFilter::Covariance& p = filter_.covariance();
  Eigen::Matrix<double, 16, 15> errors;
  errors.row(15).setZero();
  errors.topLeftCorner<9, 9>() = p.topLeftCorner<9, 9>();
  errors.topRightCorner<9, 6>() = p.block<9, 6>(0, InvariantFilter::kGyroBias);
  errors.block<6, 9>(9, 0) = p.block<6, 9>(InvariantFilter::kGyroBias, 0);
  errors.block<6, 6>(9, 9) = p.block<6, 6>(InvariantFilter::kGyroBias, InvariantFilter::kGyroBias);
  Eigen::Matrix<double, 16, 9> half;
  times_jacobian_transposed(errors, &half);
  Eigen::Matrix<double, 12, 15> half_t;
  half_t.bottomRows<3>().setZero();
  half_t.topRows<9>() = half.topRows<15>().transpose();
  Eigen::Matrix<double, 12, 9> whole;
  times_jacobian_transposed(half_t, &whole);
  base_covariance_ = whole.topRows<9>();

  // The gyro's noise at the lever, and what may happen during the delay: a step like that between
  // the last two readings at an unknown instant of it.
  const Vector3d turn = r * (gyro_ - last_gyro_), push = r * (force_ - last_force_);
  const bool fault = !imu_good_;
  const double gyro_variance = Square(gyro_noise_) + (fault ? Square(kGyroFault) : 0);
  const double force_variance =
      Square(accelerometer_noise_) + (fault ? Square(kAccelerometerFault) : 0);
  Eigen::Matrix<double, 9, 3> spread = Eigen::Matrix<double, 9, 3>::Zero();
  spread.middleRows<3>(0) = d * Matrix3d::Identity();
  spread.middleRows<3>(3) = Skew(lever);
  base_covariance_.noalias() += gyro_variance * spread * spread.transpose();
  if (placed_ && d > 0) {
    Eigen::Matrix<double, 9, 1> step;
    step << d * turn, d * push, 0.5 * d * d * push;
    base_covariance_.noalias() += step * step.transpose() / 3;
    base_covariance_.block<3, 3>(3, 3) += d * d * force_variance * Matrix3d::Identity();
  }
  // The instant of the readings is uncertain.
  Eigen::Matrix<double, 9, 1> motion;
  motion << rate, acceleration, velocity;
  base_covariance_.noalias() += Square(kTiming) * motion * motion.transpose();
}

FootContact InvariantEstimator::contact(Foot foot) const {
  const FootState& f = feet_[foot];
  if (!f.loaded) return FootContact::kNone;
  return f.slip_left > 0 ? FootContact::kSlipping : FootContact::kFirm;
}

Isometry3d InvariantEstimator::foot_pose(Foot foot) const {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = filter_.holds_position(foot) ? filter_.state().foot[foot]
                                                    : filter_.SeenPosition(feet_[foot].reading);
  pose.linear() = filter_.holds_rotation(foot) ? filter_.state().foot_rotation[foot]
                                               : filter_.SeenRotation(feet_[foot].reading);
  return pose;
}

void InvariantEstimator::Archive(StateArchive* archive) {
  velocity_filter_.Archive(archive);
  filter_.Archive(archive);
  archive->Show(joint_position_, torque_, unrest_, gyro_, last_gyro_, force_, last_force_,
                imu_good_, last_imu_good_, placed_);
  for (FootState& foot : feet_) {
    archive->Show(foot.loaded, foot.excess, foot.slip_left, foot.slip_time, foot.turn_left,
                  foot.slip_start, foot.apart_start, foot.turn_start);
  }
}

}  // namespace poise
