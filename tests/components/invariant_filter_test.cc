// The filter against independent truth: matrix exponentials, numerical integration, finite
// differences and Monte Carlo with the filter's own noise.
#include "components/state_estimator/invariant_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGravity = 9.80665;
constexpr int kSize = InvariantFilter::kSize;
using Error = InvariantFilter::Error;
using Covariance = InvariantFilter::Covariance;

// Σ_n mⁿ / (n + first)!, term by term: the matrix exponential for first = 0.
Eigen::MatrixXd Series(const Eigen::MatrixXd& m, int first) {
  Eigen::MatrixXd term = Eigen::MatrixXd::Identity(m.rows(), m.cols());
  for (int n = 1; n <= first; ++n) term /= n;
  Eigen::MatrixXd sum = term;
  for (int n = 1; n < 60; ++n) {
    term = (term * m / (n + first)).eval();
    sum += term;
  }
  return sum;
}

double LeastEigenvalue(const Eigen::MatrixXd& m) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m).eigenvalues().minCoeff();
}

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(TestSeed(static_cast<uint32_t>(seed))) {}
  double Normal() { return normal_(engine_); }
  Vector3d Normal3() { return {Normal(), Normal(), Normal()}; }
  Matrix3d Rotation() {
    return Eigen::Quaterniond(Normal(), Normal(), Normal(), Normal())
        .normalized()
        .toRotationMatrix();
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

// (0.3 rad, tests of large errors; 1e-9: the series; nearly π: the logarithm's worst place.)
std::vector<Vector3d> Rotations() {
  Random random(7);
  std::vector<Vector3d> rotations = {Vector3d::Zero()};
  for (const double angle : {1e-12, 1e-9, 1e-5, 0.0499, 0.0501, 0.3, 1.0, 2.5, 3.14}) {
    rotations.push_back(angle * random.Normal3().normalized());
  }
  return rotations;
}

TEST(LieGroup, TheExponentialIsThatOfTheMatrix) {
  Random random(1);
  for (const Vector3d& rotation : Rotations()) {
    const Vector3d a = random.Normal3(), b = random.Normal3();
    Eigen::MatrixXd tangent = Eigen::MatrixXd::Zero(5, 5);
    tangent.topLeftCorner(3, 3) = Skew(rotation);
    tangent.block(0, 3, 3, 1) = a;
    tangent.block(0, 4, 3, 1) = b;
    const Eigen::MatrixXd expected = Series(tangent, 0);
    const Gamma gamma(rotation);
    EXPECT_LT((gamma.zero - expected.topLeftCorner<3, 3>()).norm(), 1e-13);
    EXPECT_LT((gamma.one * a - expected.block<3, 1>(0, 3)).norm(), 1e-13);
    EXPECT_LT((gamma.one * b - expected.block<3, 1>(0, 4)).norm(), 1e-13);
    EXPECT_LT((RotationLog(gamma.zero) - rotation).norm(), 1e-9);
  }
}

TEST(LieGroup, GammasIntegrateARotation) {
  for (const Vector3d& rotation : Rotations()) {
    // Simpson's rule for ∫ exp(t φ^×) dt and ∫ (1 − t) exp(t φ^×) dt over 0..1.
    Matrix3d once = Matrix3d::Zero(), twice = Matrix3d::Zero();
    constexpr int kSteps = 200;
    for (int i = 0; i <= kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps;
      const double weight = (i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2) / (3.0 * kSteps);
      const Matrix3d turned =
          AngleAxisd(t * rotation.norm(), rotation.stableNormalized()).toRotationMatrix();
      once += weight * turned;
      twice += weight * (1 - t) * turned;
    }
    const Gamma gamma(rotation);
    EXPECT_LT((gamma.one - once).norm(), 1e-8);
    EXPECT_LT((gamma.two - twice).norm(), 1e-8);
  }
}

/// X with everything else that a filter holds.
struct World {
  InvariantState state;

  explicit World(Random* random) {
    state.rotation = random->Rotation();
    state.velocity = random->Normal3();
    state.position = random->Normal3();
    for (size_t f = 0; f < 2; ++f) {
      state.foot[f] = random->Normal3();
      state.foot_rotation[f] = random->Rotation();
    }
  }
};

/// exp(ξ) X by the exponential's series; biases and soles' rotations likewise.
InvariantState Moved(const InvariantState& state, const Error& error) {
  const Matrix3d turn = Series(Skew(error.head<3>()), 0),
                 jacobian = Series(Skew(error.head<3>()), 1);
  const auto moved_vector = [&](const Vector3d& v, int row) -> Vector3d {
    return turn * v + jacobian * error.segment<3>(row);
  };
  InvariantState moved;
  moved.rotation = turn * state.rotation;
  moved.velocity = moved_vector(state.velocity, InvariantFilter::kVelocity);
  moved.position = moved_vector(state.position, InvariantFilter::kPosition);
  for (int f = 0; f < 2; ++f) {
    const auto i = static_cast<size_t>(f);
    moved.foot[i] = moved_vector(state.foot[i], InvariantFilter::kFoot + 3 * f);
    const Vector3d sole = error.segment<3>(InvariantFilter::kFootRotation + 3 * f);
    moved.foot_rotation[i] = Matrix3d(Series(Skew(sole), 0)) * state.foot_rotation[i];
  }
  moved.gyro_bias = state.gyro_bias + error.segment<3>(InvariantFilter::kGyroBias);
  moved.accelerometer_bias =
      state.accelerometer_bias + error.segment<3>(InvariantFilter::kAccelerometerBias);
  moved.compliance = state.compliance + error[InvariantFilter::kCompliance];
  return moved;
}

/// ξ with estimate = exp(ξ) truth, for less than half a turn; biases and soles' rotations likewise.
Error Difference(const InvariantState& estimate, const InvariantState& truth) {
  const auto log = [](const Matrix3d& rotation) -> Vector3d {
    const AngleAxisd turn(rotation);
    return turn.angle() * turn.axis();
  };
  const Matrix3d turn = estimate.rotation * truth.rotation.transpose();
  Error error;
  error.head<3>() = log(turn);
  const Matrix3d undo = Matrix3d(Series(Skew(error.head<3>()), 1)).inverse();
  error.segment<3>(InvariantFilter::kVelocity) = undo * (estimate.velocity - turn * truth.velocity);
  error.segment<3>(InvariantFilter::kPosition) = undo * (estimate.position - turn * truth.position);
  for (int f = 0; f < 2; ++f) {
    const auto i = static_cast<size_t>(f);
    error.segment<3>(InvariantFilter::kFoot + 3 * f) =
        undo * (estimate.foot[i] - turn * truth.foot[i]);
    error.segment<3>(InvariantFilter::kFootRotation + 3 * f) =
        log(estimate.foot_rotation[i] * truth.foot_rotation[i].transpose());
  }
  error.segment<3>(InvariantFilter::kGyroBias) = estimate.gyro_bias - truth.gyro_bias;
  error.segment<3>(InvariantFilter::kAccelerometerBias) =
      estimate.accelerometer_bias - truth.accelerometer_bias;
  error[InvariantFilter::kCompliance] = estimate.compliance - truth.compliance;
  return error;
}

ImuStep Readings(const Vector3d& rate, const Vector3d& force) {
  ImuStep imu;
  imu.angular_velocity = rate;
  imu.acceleration = force;
  imu.angular_velocity_noise.setZero();
  imu.acceleration_noise.setZero();
  return imu;
}

InvariantState Propagated(const InvariantState& state, const ImuStep& imu, double dt) {
  InvariantFilter filter(kGravity);
  filter.Set(state, Covariance::Zero());
  filter.Propagate(imu, dt);
  return filter.state();
}

// Integrates the equations of motion with readings that are constant in the IMU's frame.
InvariantState Integrated(InvariantState state, const Vector3d& rate, const Vector3d& force,
                          double dt) {
  constexpr int kSteps = 4000;
  const double h = dt / kSteps;
  const Matrix3d half = AngleAxisd(h / 2 * rate.norm(), rate.stableNormalized()).toRotationMatrix();
  for (int i = 0; i < kSteps; ++i) {
    const Vector3d a = state.rotation * half * force - kGravity * Vector3d::UnitZ();
    state.position += h * state.velocity + h * h / 2 * a;
    state.velocity += h * a;
    state.rotation = state.rotation * half * half;
  }
  return state;
}

TEST(InvariantFilter, PropagatesAsTheEquationsOfMotion) {
  Random random(2);
  for (const double dt : {0.002, 0.05, 0.5}) {
    const World world(&random);
    const Vector3d rate = random.Normal3(), force = 10 * random.Normal3();
    const InvariantState found = Propagated(world.state, Readings(rate, force), dt);
    const InvariantState expected = Integrated(world.state, rate, force, dt);
    EXPECT_LT((found.rotation - expected.rotation).norm(), 1e-11);
    EXPECT_LT((found.velocity - expected.velocity).norm(), 1e-7);
    EXPECT_LT((found.position - expected.position).norm(), 1e-7);
    EXPECT_EQ(found.foot[1], world.state.foot[1]);
  }
}

// Without biases the error's way does not depend on the state, even for large errors, and is the
// exponential of a linear equation (Barrau and Bonnabel's log-linear property).
TEST(InvariantFilter, TheErrorPropagatesIndependentlyOfTheState) {
  Random random(3);
  constexpr double kStep = 0.1;
  for (int trial = 0; trial < 20; ++trial) {
    Error error = Error::Zero();
    for (int i = 0; i < 15; ++i) error[i] = 0.5 * random.Normal();
    // The same at every state and for all readings.
    Error expected = error;
    const Vector3d gravity(0, 0, -kGravity);
    expected.segment<3>(3) += kStep * gravity.cross(error.head<3>());
    expected.segment<3>(6) +=
        kStep * error.segment<3>(3) + kStep * kStep / 2 * gravity.cross(error.head<3>());
    const World world(&random);
    const ImuStep imu = Readings(random.Normal3(), 10 * random.Normal3());
    const InvariantState truth = Propagated(world.state, imu, kStep);
    const InvariantState estimate = Propagated(Moved(world.state, error), imu, kStep);
    EXPECT_LT((Difference(estimate, truth) - expected).norm(), 1e-10) << trial;
  }
}

// The covariance against finite differences of the error.
TEST(InvariantFilter, TheCovariancePropagatesAsTheError) {
  Random random(4);
  constexpr double kStep = 0.002, kSmall = 1e-6;
  World world(&random);
  const ImuStep imu = Readings(random.Normal3(), 10 * random.Normal3());
  InvariantFilter filter(kGravity);
  Covariance root = Covariance::Zero();
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) root(i, j) = random.Normal();
  }
  // The way in: soles are held through readings.
  filter.Set(world.state, root * root.transpose());
  for (const robot::Foot foot : robot::kFeet) {
    SoleReading reading;
    reading.position = random.Normal3();
    reading.rotation = random.Rotation();
    reading.noise.setIdentity();
    filter.HoldPosition(foot, reading);
    filter.HoldRotation(foot, reading);
  }
  const InvariantState start = filter.state();
  const Covariance before = filter.covariance();
  filter.Propagate(imu, kStep);
  Covariance transition;
  for (int i = 0; i < kSize; ++i) {
    const Error error = kSmall * Error::Unit(i);
    transition.col(i) = (Difference(Propagated(Moved(start, error), imu, kStep), filter.state()) -
                         Difference(Propagated(Moved(start, -error), imu, kStep), filter.state())) /
                        (2 * kSmall);
  }
  const Covariance expected = transition * before * transition.transpose();
  // First order in the biases' columns: what the step turns, 0.5 |ω| dt² times the lever.
  EXPECT_LT((filter.covariance() - expected).norm(), 3e-5 * before.norm());
  Covariance without = transition;
  without.middleCols<6>(InvariantFilter::kGyroBias).setIdentity();
  EXPECT_GT((without * before * without.transpose() - filter.covariance()).norm(),
            3e-4 * before.norm());
}

// Gravity along z, an IMU that sways above two soles: the truth of the tests below.
class Swaying {
 public:
  static constexpr double kStep = 0.002;
  // Noise of each sample and walks of what is taken to be constant.
  static constexpr double kGyro = 2e-4, kForce = 1.7e-2, kSole = 1e-4, kTurn = 1e-4;
  static constexpr double kWindup = 2e-3;  // m and rad, by the compliance
  static constexpr double kWalk = 3e-4, kTurnWalk = 3e-4, kGyroWalk = 1e-5, kForceWalk = 1e-3;

  explicit Swaying(uint64_t seed) : random_(seed) {
    state.position = Vector3d(0.1, 0.05, 0.9);
    state.foot = {Vector3d(0, -0.1, 0), Vector3d(0, 0.1, 0)};
    state.velocity = Vector3d(0.1, -0.05, 0);
  }

  /// Moves on, and gives what the filter may know.
  ImuStep Next() {
    time += kStep;
    const Vector3d rate = 0.5 * Vector3d(std::sin(2 * time), std::cos(3 * time), std::sin(time));
    const Vector3d push(std::cos(2.5 * time), -0.7 * std::sin(2 * time), 0.5 * std::cos(4 * time));
    const Vector3d force = state.rotation.transpose() * (push + kGravity * Vector3d::UnitZ());
    const Matrix3d turn =
        AngleAxisd(kStep * rate.norm(), rate.stableNormalized()).toRotationMatrix();
    const Matrix3d half =
        AngleAxisd(kStep / 2 * rate.norm(), rate.stableNormalized()).toRotationMatrix();
    const Vector3d a = state.rotation * half * force - kGravity * Vector3d::UnitZ();
    state.position += kStep * state.velocity + kStep * kStep / 2 * a;
    state.velocity += kStep * a;
    state.rotation = state.rotation * turn;
    const double root = std::sqrt(kStep);
    for (size_t f = 0; f < 2; ++f) {
      state.foot[f] += scale * kWalk * root * random_.Normal3();
      state.foot_rotation[f] =
          Gamma(scale * kTurnWalk * root * random_.Normal3()).zero * state.foot_rotation[f];
    }
    ImuStep imu = Readings(rate + state.gyro_bias + scale * kGyro * random_.Normal3(),
                           force + state.accelerometer_bias + scale * kForce * random_.Normal3());
    imu.angular_velocity_noise = kGyro * kGyro * Matrix3d::Identity();
    imu.acceleration_noise = kForce * kForce * Matrix3d::Identity();
    imu.gyro_bias_walk = kGyroWalk;
    imu.accelerometer_bias_walk = kForceWalk;
    state.gyro_bias += scale * kGyroWalk * root * random_.Normal3();
    state.accelerometer_bias += scale * kForceWalk * root * random_.Normal3();
    return imu;
  }
  SoleReading Sole(robot::Foot foot) {
    SoleReading reading;
    // As torques that change wind up the gears, read as if these had no compliance to find.
    for (int i = 0; i < 6; ++i) {
      reading.by_compliance[i] =
          kWindup * std::sin((1 + 0.3 * i) * time + i + 3 * static_cast<int>(foot));
    }
    const double unknown = reading.compliance - state.compliance;
    const Vector3d slip =
        scale * kSole * random_.Normal3() + unknown * reading.by_compliance.head<3>();
    const Vector3d turn =
        scale * kTurn * random_.Normal3() + unknown * reading.by_compliance.tail<3>();
    reading.position = state.rotation.transpose() * (state.foot[foot] - state.position + slip);
    reading.rotation = state.rotation.transpose() * Gamma(turn).zero * state.foot_rotation[foot];
    reading.noise.setZero();
    reading.noise.diagonal().head<3>().setConstant(kSole * kSole);
    reading.noise.diagonal().tail<3>().setConstant(kTurn * kTurn);
    return reading;
  }
  static void Loosen(InvariantFilter* filter) {
    for (const robot::Foot foot : robot::kFeet) {
      filter->Loosen(foot, kWalk * kWalk * kStep, kTurnWalk * kTurnWalk * kStep);
    }
  }

  InvariantState state;
  double time = 0;
  double scale = 1;  // of all noise that is drawn
  Random& random() { return random_; }

 private:
  Random random_;
};

Covariance StartCovariance() {
  Error deviation = Error::Zero();
  deviation.head<3>().setConstant(0.02);
  deviation.segment<3>(3).setConstant(0.1);
  deviation.segment<3>(6).setConstant(0.05);
  deviation.segment<3>(InvariantFilter::kGyroBias).setConstant(2e-3);
  deviation.segment<3>(InvariantFilter::kAccelerometerBias).setConstant(0.05);
  deviation[InvariantFilter::kCompliance] = 0.3;
  return deviation.cwiseAbs2().asDiagonal();
}

/// A filter that begins off the truth by `error`.
InvariantFilter Begin(Swaying* truth, const Error& error, const Covariance& covariance) {
  InvariantFilter filter(kGravity);
  filter.Set(Moved(truth->state, error), covariance);
  for (const robot::Foot foot : robot::kFeet) {
    const SoleReading reading = truth->Sole(foot);
    filter.HoldPosition(foot, reading);
    filter.HoldRotation(foot, reading);
  }
  return filter;
}

void FollowTruth(Swaying* truth, InvariantFilter* filter, double duration) {
  for (int i = 0; i < std::lround(duration / Swaying::kStep); ++i) {
    const ImuStep imu = truth->Next();
    filter->Propagate(imu, Swaying::kStep);
    Swaying::Loosen(filter);
    for (const robot::Foot foot : robot::kFeet)
      ASSERT_TRUE(filter->Correct(foot, truth->Sole(foot)));
  }
}

// Over many draws of start, noise and walks: eᵀ P⁻¹ e is chi-squared distributed with 28 degrees of
// freedom, its mean over N runs within 4 √(2 · 28 / N) of 28 but once in 15,000, and 95 % of it lie
// below 41.34.
TEST(InvariantFilter, TheCovarianceIsThatOfTheErrors) {
  constexpr int kRuns = 150;
  for (const double duration : {0.1, 1.0}) {
    double sum = 0, sum_innovation = 0;
    int inside = 0;
    for (int run = 0; run < kRuns; ++run) {
      Swaying truth(static_cast<uint64_t>(run) + 10);
      truth.state.gyro_bias = 1e-3 * truth.random().Normal3();
      const Covariance start = 0.04 * StartCovariance();
      Error error = Error::Zero();
      for (int i = 0; i < kSize; ++i) {
        error[i] = std::sqrt(start(i, i)) * truth.random().Normal();
      }
      error.segment<6>(InvariantFilter::kFoot).setZero();
      InvariantFilter filter = Begin(&truth, error, start);
      ASSERT_NO_FATAL_FAILURE(FollowTruth(&truth, &filter, duration));
      const Error off = Difference(filter.state(), truth.state);
      const double nees =
          off.dot(Eigen::MatrixXd(filter.covariance()).ldlt().solve(Eigen::VectorXd(off)));
      sum += nees;
      inside += nees < 41.337 ? 1 : 0;
      const InvariantFilter::Innovation test =
          filter.Test(robot::Foot::kRight, truth.Sole(robot::Foot::kRight));
      sum_innovation += test.position + test.rotation;
    }
    EXPECT_NEAR(sum / kRuns, 28, 4 * std::sqrt(2.0 * 28 / kRuns)) << duration;
    EXPECT_NEAR(sum_innovation / kRuns, 6, 4 * std::sqrt(2.0 * 6 / kRuns)) << duration;
    EXPECT_NEAR(inside / double{kRuns}, 0.95, 4 * std::sqrt(0.95 * 0.05 / kRuns)) << duration;
  }
}

TEST(InvariantFilter, ConvergesFromAWrongTiltAndVelocity) {
  Swaying truth(5);
  Error error = Error::Zero();
  error.head<3>() << 0.2, -0.15, 0;
  error.segment<3>(3) << 0.5, -0.3, 0.2;
  Covariance start = 100 * StartCovariance();
  start.diagonal().segment<3>(InvariantFilter::kAccelerometerBias).setConstant(1e-6);
  // No gear is three times as stiff as was assumed, or less than not stiff at all.
  start(InvariantFilter::kCompliance, InvariantFilter::kCompliance) = 0.09;
  InvariantFilter filter = Begin(&truth, error, start);
  FollowTruth(&truth, &filter, 0.2);
  EXPECT_LT(Difference(filter.state(), truth.state).segment<3>(3).norm(), 0.03);
  FollowTruth(&truth, &filter, 4.8);
  const Error off = Difference(filter.state(), truth.state);
  const auto deviation = [&](int row, int size) {
    return std::sqrt(filter.covariance().diagonal().segment(row, size).sum());
  };
  const double tilt = deviation(0, 2), velocity = deviation(3, 3);
  EXPECT_LT(tilt, 5e-4);
  EXPECT_LT(velocity, 1.5e-3);
  // A Gaussian error is five deviations long once in millions of draws.
  EXPECT_LT(off.head<2>().norm(), 5 * tilt);
  EXPECT_LT(off.segment<3>(3).norm(), 5 * velocity);
}

TEST(InvariantFilter, FindsTheBiases) {
  Swaying truth(6);
  truth.state.gyro_bias = Vector3d(3e-3, -2e-3, 1e-3);
  truth.state.accelerometer_bias = Vector3d(0.05, -0.1, 0.08);
  Covariance start = StartCovariance();
  InvariantFilter filter = Begin(&truth, Error::Zero(), start);
  Covariance unknown = start;
  unknown.diagonal().segment<3>(InvariantFilter::kGyroBias).setConstant(1e-4);
  unknown.diagonal().segment<3>(InvariantFilter::kAccelerometerBias).setConstant(1e-2);
  InvariantState wrong = truth.state;
  wrong.gyro_bias.setZero();
  wrong.accelerometer_bias.setZero();
  filter.Set(wrong, unknown);
  for (const robot::Foot foot : robot::kFeet) {
    filter.HoldPosition(foot, truth.Sole(foot));
    filter.HoldRotation(foot, truth.Sole(foot));
  }
  FollowTruth(&truth, &filter, 20);
  // The biases walk all the while; what remains is in the covariance.
  const Error off = Difference(filter.state(), truth.state);
  EXPECT_LT(off.segment<3>(InvariantFilter::kGyroBias).norm(), 3e-4);
  EXPECT_LT(off.segment<3>(InvariantFilter::kAccelerometerBias).norm(), 0.02);
}

TEST(InvariantFilter, FindsTheCompliance) {
  for (const double compliance : {-0.3, 0.4}) {
    Swaying truth(12);
    truth.state.compliance = compliance;
    InvariantFilter filter = Begin(&truth, Error::Zero(), StartCovariance());
    InvariantState unaware = truth.state;
    unaware.compliance = 0;
    filter.Set(unaware, StartCovariance());
    for (const robot::Foot foot : robot::kFeet) {
      filter.HoldPosition(foot, truth.Sole(foot));
      filter.HoldRotation(foot, truth.Sole(foot));
    }
    FollowTruth(&truth, &filter, 10);
    const double deviation =
        std::sqrt(filter.covariance()(InvariantFilter::kCompliance, InvariantFilter::kCompliance));
    EXPECT_LT(deviation, 0.05);
    EXPECT_NEAR(filter.state().compliance, compliance, 4 * deviation);
  }
}

/// Covariance along some directions, the others known.
Eigen::MatrixXd Shown(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& directions) {
  return (directions.transpose() * covariance.inverse() * directions).inverse();
}

// Neither feet nor IMU see heading and position: readings never make them better known.
TEST(InvariantFilter, HeadingAndPositionAreNotObservable) {
  Swaying truth(8);
  InvariantFilter filter = Begin(&truth, Error::Zero(), StartCovariance());
  Error last = filter.covariance().diagonal();
  const Error first = last;
  // ξ of a turn about the vertical through the origin and of a shift: Φ and H leave them as they
  // are, so their share of P can only grow.
  Eigen::MatrixXd blind = Eigen::MatrixXd::Zero(kSize, 4);
  blind(2, 0) = 1;
  blind(InvariantFilter::kFootRotation + 2, 0) = blind(InvariantFilter::kFootRotation + 5, 0) = 1;
  for (int i = 0; i < 3; ++i) {
    blind(6 + i, 1 + i) = blind(9 + i, 1 + i) = blind(12 + i, 1 + i) = 1;
  }
  for (int step = 0; step < 20; ++step) {
    const Eigen::MatrixXd before = Shown(filter.covariance(), blind);
    FollowTruth(&truth, &filter, 0.1);
    const Eigen::MatrixXd after = Shown(filter.covariance(), blind);
    // Positive semidefinite growth, to rounding.
    EXPECT_GT(LeastEigenvalue(after - before), -1e-9 * before.norm()) << step;
  }
  last = filter.covariance().diagonal();
  EXPECT_GT(last[2], 0.99 * first[2]);
  for (int i = 6; i < 9; ++i) EXPECT_GT(last[i], 0.99 * first[i]);
  // What is observable does become better known.
  for (const int i : {0, 1, 3, 4, 5, 15, 16, 17}) EXPECT_LT(last[i], 0.5 * first[i]) << i;
}

// Conditioning of a Gaussian: of the rest on a sum that is known, by the inverse covariance.
TEST(InvariantFilter, WhatIsKnownConditionsTheRest) {
  Random random(13);
  Covariance root;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) root(i, j) = random.Normal();
  }
  const World world(&random);
  InvariantFilter filter(kGravity);
  filter.Set(world.state, root * root.transpose());
  Error row;
  for (int i = 0; i < kSize; ++i) row[i] = random.Normal();
  constexpr double kDeviation = 0.3;
  const Eigen::MatrixXd information = Eigen::MatrixXd(filter.covariance()).inverse() +
                                      row * row.transpose() / (kDeviation * kDeviation);
  filter.Know(row, kDeviation);
  EXPECT_LT((filter.covariance() - information.inverse()).norm(),
            1e-6 * information.inverse().norm());
  EXPECT_EQ(filter.state().position, world.state.position);
  filter.Know(row, 0);
  EXPECT_NEAR(row.dot(filter.covariance() * row), 0, 1e-9);
  filter.Know(row, 0);  // again: nothing to learn
  EXPECT_TRUE(filter.covariance().allFinite());
}

TEST(InvariantFilter, StaysPositiveDefiniteOverMinutes) {
  Swaying truth(9);
  InvariantFilter filter = Begin(&truth, Error::Zero(), StartCovariance());
  FollowTruth(&truth, &filter, 60);
  const Covariance& c = filter.covariance();
  EXPECT_EQ(c, c.transpose());
  EXPECT_GT(LeastEigenvalue(c), 0);
  EXPECT_NEAR((filter.state().rotation.transpose() * filter.state().rotation).trace(), 3, 1e-12);
}

TEST(InvariantFilter, AReleasedFootNoLongerCountsAndComesBackWhereItIs) {
  Swaying truth(11);
  InvariantFilter filter = Begin(&truth, Error::Zero(), StartCovariance());
  FollowTruth(&truth, &filter, 0.5);
  filter.ReleasePosition(robot::Foot::kLeft);
  filter.ReleaseRotation(robot::Foot::kLeft);
  const Covariance before = filter.covariance();
  EXPECT_TRUE(filter.Correct(robot::Foot::kLeft, truth.Sole(robot::Foot::kLeft)));
  EXPECT_EQ(filter.covariance(), before);
  EXPECT_EQ(filter.Test(robot::Foot::kLeft, truth.Sole(robot::Foot::kLeft)).position, 0);
  truth.state.foot[1] += Vector3d(0.3, 0, 0.1);
  truth.state.foot_rotation[1] = AngleAxisd(0.4, Vector3d::UnitX()).toRotationMatrix();
  const SoleReading reading = truth.Sole(robot::Foot::kLeft);
  filter.HoldPosition(robot::Foot::kLeft, reading);
  filter.HoldRotation(robot::Foot::kLeft, reading);
  EXPECT_LT((filter.state().foot[1] - truth.state.foot[1]).norm(), 0.01);
  // What is known of it is what is known of the IMU and its reading: nothing is learned by taking
  // it in.
  EXPECT_LT(filter.Test(robot::Foot::kLeft, reading).position, 1e-9);
  const Covariance& after = filter.covariance();
  EXPECT_EQ((after.topLeftCorner<9, 9>()), (before.topLeftCorner<9, 9>()));
}

}  // namespace
}  // namespace poise
