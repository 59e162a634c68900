#include "components/state_estimator/invariant_estimator.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/components/base_motion.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTick = BaseMotion::kPeriod;

std::string DyrosPath() {
  return std::string(POISE_SOURCE_DIR) + "/deploy/robots/dyros/dyros_legs.pbtxt";
}
// Rotated joint frames, tilted soles, arms, and the IMU above a waist joint.
std::string MantisPath() {
  return std::string(POISE_SOURCE_DIR) + "/tests/robot/data/mantis.pbtxt";
}

constexpr double kChiSquared9 = 16.919;  // exceeded with 5 % by 9 degrees of freedom

Eigen::Matrix<double, 9, 1> BaseError(const robot::RobotState& estimate,
                                      const robot::RobotState& truth) {
  Eigen::Matrix<double, 9, 1> error;
  error << RotationLog(
      (estimate.base_orientation * truth.base_orientation.conjugate()).toRotationMatrix()),
      estimate.base_linear_velocity - truth.base_linear_velocity,
      estimate.base_position - truth.base_position;
  return error;
}

class FollowMotion {
 public:
  explicit FollowMotion(BaseMotion* motion, const StateEstimatorConfig& config = {})
      : motion_(*motion), estimator_(motion->model(), AsTheMotion(config), kTick) {}

  /// What the motion's sensors are where nothing else is given: in time, on rigid gears.
  static StateEstimatorConfig AsTheMotion(StateEstimatorConfig config) {
    InvariantEkfConfig* ekf = config.mutable_invariant_ekf();
    if (!ekf->has_sensor_delay()) ekf->set_sensor_delay(0);
    if (!ekf->has_gear_stiffness()) ekf->set_gear_stiffness(0);
    return config;
  }

  void Step() {
    motion_.Next();
    estimator_.Update(motion_.sensors(), kTick);
  }
  void RunTo(double time) {
    while (motion_.time() < time - 1e-9) Step();
  }
  Eigen::Matrix<double, 9, 1> Error() const {
    return BaseError(estimator_.state(), motion_.truth());
  }
  double Nees() const { return Error().dot(estimator_.covariance().ldlt().solve(Error())); }
  const InvariantEstimator& estimator() const { return estimator_; }

 private:
  BaseMotion& motion_;
  InvariantEstimator estimator_;
};

class AnyInvariantRobot : public testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Robots, AnyInvariantRobot, testing::Values(DyrosPath(), MantisPath()),
                         [](const auto& test) {
                           return test.param == DyrosPath() ? "Dyros" : "Mantis";
                         });

// Readings without errors: what remains is the second order of integration and, on mantis,
// whose IMU turns with the waist, the lag of the joint velocities.
TEST_P(AnyInvariantRobot, FollowsExactReadings) {
  BaseMotion motion(GetParam());
  Sway(&motion, 0.02);
  FollowMotion follow(&motion);
  const bool waist = GetParam() == MantisPath();
  while (motion.time() < 10) {
    follow.Step();
    const auto error = follow.Error();
    ASSERT_LT(error.head<3>().norm(), 2e-5) << motion.time();
    ASSERT_LT(error.segment<3>(3).norm(), waist ? 6e-3 : 5e-4) << motion.time();
    ASSERT_LT(error.tail<3>().norm(), 1e-4) << motion.time();
    for (const robot::Foot foot : robot::kFeet) {
      ASSERT_EQ(follow.estimator().contact(foot), FootContact::kFirm) << motion.time();
    }
  }
}

// Noise, biases and rounding of the robot's file; the loads' noise.
TEST_P(AnyInvariantRobot, FollowsNoisyReadings) {
  BaseMotion motion(GetParam());
  Sway(&motion, 0.02);
  SensorErrors& errors = motion.errors();
  errors = TypicalErrors(*motion.model());
  // mantis has no noise of its own.
  errors.gyro_noise = 1e-4;
  errors.gyro_bias = Vector3d(2e-4, -1e-4, 3e-4);
  errors.accelerometer_noise = 1e-2;
  errors.accelerometer_bias = 0.1 * Vector3d(1, -1, 1) / std::sqrt(3.0);
  errors.load_noise = 1;
  FollowMotion follow(&motion);
  const bool waist = GetParam() == MantisPath();
  while (motion.time() < 20) {
    follow.Step();
    const auto error = follow.Error();
    ASSERT_LT(error.head<2>().norm(), 1e-3) << motion.time();
    ASSERT_LT(error.segment<3>(3).norm(), waist ? 0.02 : 5e-3) << motion.time();
    ASSERT_LT(error.tail<3>().norm(), 1.5e-3) << motion.time();
  }
  EXPECT_LT((follow.estimator().filter().state().gyro_bias - errors.gyro_bias).norm(), 5e-5);
}

TEST(InvariantEstimator, AStepUpIsFollowedAndTheFootAnchoredWhereItLands) {
  BaseMotion motion(DyrosPath());
  StepUp(&motion);
  motion.errors() = TypicalErrors(*motion.model());
  FollowMotion follow(&motion);
  while (motion.time() < 8) {
    follow.Step();
    const double t = motion.time();
    ASSERT_LT(follow.Error().tail<3>().norm(), 2e-3) << t;
    if (t > 1.3 && t < 2.7) {
      ASSERT_EQ(follow.estimator().contact(robot::Foot::kLeft), FootContact::kNone) << t;
    }
    ASSERT_EQ(follow.estimator().contact(robot::Foot::kRight), FootContact::kFirm) << t;
  }
  EXPECT_EQ(follow.estimator().contact(robot::Foot::kLeft), FootContact::kFirm);
  const Isometry3d landed = motion.script().foot[1](8);
  EXPECT_GT(landed.translation().z(), 0.0499);
  EXPECT_LT((follow.estimator().foot_pose(robot::Foot::kLeft).translation() - landed.translation())
                .norm(),
            2e-3);
}

// One foot slides, sinks or turns while both carry the same; the other and the IMU tell.
struct MotionOfAFoot {
  const char* name;
  Vector3d way, turn;
};
class MovingFoot : public testing::TestWithParam<MotionOfAFoot> {};

TEST_P(MovingFoot, IsFoundAndLeavesTheBaseAlone) {
  BaseMotion motion(DyrosPath());
  motion.errors() = TypicalErrors(*motion.model());
  const Isometry3d start = motion.script().foot[1](0);
  motion.script().foot[1] = [=](double t) {
    const double s = Ramp(t, 1, 1.5);
    Isometry3d foot = start;
    foot.translation() += s * GetParam().way;
    foot.linear() = Gamma(s * GetParam().turn).zero * start.linear();
    return foot;
  };
  FollowMotion follow(&motion);
  follow.RunTo(1);
  const auto before = follow.Error();
  double slipping = 0;
  while (motion.time() < 2) {
    follow.Step();
    const bool slips = follow.estimator().contact(robot::Foot::kLeft) == FootContact::kSlipping;
    slipping += slips ? kTick : 0;
    ASSERT_EQ(follow.estimator().contact(robot::Foot::kRight), FootContact::kFirm) << motion.time();
  }
  const auto moved = follow.Error() - before;
  EXPECT_LT(moved.tail<3>().norm(), 1e-3);
  EXPECT_LT(moved.head<3>().norm(), 1e-3);
  EXPECT_EQ(follow.estimator().contact(robot::Foot::kLeft), FootContact::kFirm);  // at rest again
  const Isometry3d end = motion.script().foot[1](2);
  EXPECT_LT(
      (follow.estimator().foot_pose(robot::Foot::kLeft).translation() - end.translation()).norm(),
      1.5e-3);
  EXPECT_LT(RotationLog(follow.estimator().foot_pose(robot::Foot::kLeft).linear() *
                        end.linear().transpose())
                .norm(),
            2e-3);
  if (GetParam().way.norm() > 0) {
    EXPECT_GT(slipping, 0.25);
    EXPECT_LT(slipping, 0.7);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Motions, MovingFoot,
    testing::Values(MotionOfAFoot{"Slides", Vector3d(0.03, 0, 0), Vector3d::Zero()},
                    MotionOfAFoot{"Sinks", Vector3d(0, 0, -0.02), Vector3d(0.03, 0, 0)},
                    MotionOfAFoot{"Turns", Vector3d::Zero(), Vector3d(0, 0, 0.1)}),
    [](const auto& test) { return test.param.name; });

TEST(InvariantEstimator, AStandingFootIsSeldomTakenForASlippingOne) {
  BaseMotion motion(DyrosPath());
  Sway(&motion, 0.02);
  motion.errors() = TypicalErrors(*motion.model());
  FollowMotion follow(&motion);
  int slipping = 0;
  double innovation = 0;
  for (int i = 0; i < 10000; ++i) {
    follow.Step();
    for (const robot::Foot foot : robot::kFeet) {
      slipping += follow.estimator().contact(foot) == FootContact::kSlipping ? 1 : 0;
      innovation += follow.estimator().innovation(foot);
    }
  }
  EXPECT_EQ(slipping, 0);
  // Chi-squared with 3 degrees of freedom has a mean of 3; the noise taken is never less than what
  // there is.
  EXPECT_GT(innovation / 20000, 0.1);
  EXPECT_LT(innovation / 20000, 3.3);
}

// Rocking on its edge, the sole's rotation says nothing.
TEST(InvariantEstimator, ASoleOnItsEdgeDoesNotTurnTheBase) {
  BaseMotion motion(DyrosPath());
  const Isometry3d start = motion.script().foot[1](0);
  const double half_width = motion.model()->feet()[1].width / 2;
  // About the inner edge, which stays where it is.
  motion.script().foot[1] = [=](double t) -> Isometry3d {
    const Eigen::Translation3d edge(0, -half_width, 0);
    return start * edge * AngleAxisd(0.04 * Ramp(t, 0.5, 1), Vector3d::UnitX()) * edge.inverse();
  };
  FollowMotion follow(&motion);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    motion.Next();
    BaseSensors sensors = motion.sensors();
    if (motion.time() > 0.48) sensors.foot_cop[1].y() = -half_width;
    InvariantEstimator& estimator = const_cast<InvariantEstimator&>(follow.estimator());
    estimator.Update(sensors, kTick);
    worst = std::max(worst, follow.Error().head<3>().norm());
    if (motion.time() > 0.5) {
      ASSERT_FALSE(estimator.filter().holds_rotation(robot::Foot::kLeft));
    }
  }
  EXPECT_LT(worst, 5e-4);
  EXPECT_LT(follow.Error().tail<3>().norm(), 1e-3);
}

// The gears between motors and links wind up under load; the encoders sit at the motors.
TEST(InvariantEstimator, WindupOfTheGearsIsTakenOut) {
  constexpr double kStiffness = 2e4;
  for (const bool known : {false, true}) {
    BaseMotion motion(DyrosPath());
    const int n = motion.model()->num_joints();
    StateEstimatorConfig config;
    config.mutable_invariant_ekf()->set_gear_stiffness(known ? kStiffness : 0);
    InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion(config), kTick);
    Eigen::VectorXd torque(n), reading(n);
    for (int j = 0; j < n; ++j) torque[j] = 40 * std::sin(1 + j);
    motion.Next();
    BaseSensors sensors = motion.sensors();
    reading = sensors.joint_position + torque / kStiffness;
    const BaseSensors wound = {{reading.data(), n}, sensors.angular_velocity, sensors.acceleration,
                               sensors.foot_load,   sensors.foot_cop,         {torque.data(), n}};
    estimator.Update(wound, kTick);
    const double off = (estimator.state().base_position - motion.truth().base_position).norm();
    if (known) {
      EXPECT_LT(off, 1e-9);
    } else {
      EXPECT_GT(off, 2e-4);
    }
  }
}

// Drives that are just switched on: the first readings show no torque, though the gears carry the
// robot. The soles stand on the ground all the while.
TEST(InvariantEstimator, TorquesThatCannotBeTrustedAtFirstDoNotTiltTheWorld) {
  constexpr double kStiffness = 2e4;
  BaseMotion motion(DyrosPath());
  motion.errors() = TypicalErrors(*motion.model());
  const int n = motion.model()->num_joints();
  StateEstimatorConfig config;
  config.mutable_invariant_ekf()->set_gear_stiffness(kStiffness);
  InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion(config), kTick);
  Eigen::VectorXd torque(n), reading(n), shown(n);
  for (int j = 0; j < n; ++j) torque[j] = 25 * std::sin(1 + j);
  int inside = 0, ticks = 0;
  while (motion.time() < 2) {
    motion.Next();
    const BaseSensors sensors = motion.sensors();
    reading = sensors.joint_position + torque / kStiffness;
    shown = std::min(motion.time() / 0.012, 1.0) * torque;
    estimator.Update({{reading.data(), n},
                      sensors.angular_velocity,
                      sensors.acceleration,
                      sensors.foot_load,
                      sensors.foot_cop,
                      {shown.data(), n}},
                     kTick);
    const auto error = BaseError(estimator.state(), motion.truth());
    inside += error.dot(estimator.covariance().ldlt().solve(error)) < kChiSquared9 ? 1 : 0;
    ++ticks;
  }
  const double tilt = BaseError(estimator.state(), motion.truth()).head<2>().norm();
  EXPECT_LT(tilt, 1e-4);
  EXPECT_GT(inside, 0.9 * ticks);
}

// Torques that change show how soft the gears are: what the covariance says of the base holds
// although the stiffness is off by a fifth.
TEST(InvariantEstimator, AnUncertainStiffnessIsFound) {
  constexpr double kStiffness = 2e4;
  BaseMotion motion(DyrosPath());
  Sway(&motion, 0.02);
  motion.errors() = TypicalErrors(*motion.model());
  const int n = motion.model()->num_joints();
  StateEstimatorConfig config;
  config.mutable_invariant_ekf()->set_gear_stiffness(1.25 * kStiffness);
  InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion(config), kTick);
  Eigen::VectorXd torque(n), reading(n);
  int inside = 0, ticks = 0;
  while (motion.time() < 10) {
    motion.Next();
    for (int j = 0; j < n; ++j) torque[j] = 30 * std::sin(1 + j + 0.8 * motion.time());
    BaseSensors sensors = motion.sensors();
    reading = sensors.joint_position + torque / kStiffness;
    const BaseSensors wound = {{reading.data(), n}, sensors.angular_velocity, sensors.acceleration,
                               sensors.foot_load,   sensors.foot_cop,         {torque.data(), n}};
    estimator.Update(wound, kTick);
    const auto error = BaseError(estimator.state(), motion.truth());
    inside += error.dot(estimator.covariance().ldlt().solve(error)) < kChiSquared9 ? 1 : 0;
    ++ticks;
  }
  const double share = static_cast<double>(inside) / ticks;
  EXPECT_GT(share, 0.9);
  EXPECT_NEAR(estimator.filter().state().compliance, 0.25, 0.025);
}

// A loop that rings: joints read wrong by ten times an encoder's step, to and fro at 100 Hz, while
// one sole alone carries the robot. It is not taken for a slipping one, nor for a turning IMU.
TEST(InvariantEstimator, ReadingsWorseThanTheirNoiseCountLess) {
  BaseMotion motion(DyrosPath());
  motion.script().load = {[](double) { return 1.0; }, [](double) { return 0.0; }};
  motion.errors() = TypicalErrors(*motion.model());
  const int n = motion.model()->num_joints();
  InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion({}), kTick);
  Eigen::VectorXd reading(n);
  int slips = 0;
  while (motion.time() < 4) {
    motion.Next();
    const BaseSensors sensors = motion.sensors();
    const double t = motion.time();
    // Begun gently, as a loop begins to ring.
    const double amplitude = 2e-4 * Ramp(t, 0.5, 1.5);
    for (int j = 0; j < n; ++j) {
      reading[j] = sensors.joint_position[j] +
                   amplitude * std::sin(2 * std::numbers::pi * 100 * t + 0.7 * j);
    }
    estimator.Update({{reading.data(), n},
                      sensors.angular_velocity,
                      sensors.acceleration,
                      sensors.foot_load,
                      sensors.foot_cop},
                     kTick);
    slips += estimator.contact(robot::Foot::kRight) == FootContact::kSlipping ? 1 : 0;
  }
  EXPECT_EQ(slips, 0);
  const auto error = BaseError(estimator.state(), motion.truth());
  EXPECT_LT(error.head<2>().norm(), 1e-3);
  EXPECT_LT(error.tail<3>().norm(), 1e-3);
  EXPECT_LT((estimator.filter().state().gyro_bias - motion.errors().gyro_bias).norm(), 5e-4);
}

// Readings of one cycle ago; the base moves at 0.2 m/s and turns.
TEST(InvariantEstimator, TheDelayOfTheReadingsIsPredicted) {
  constexpr int kDelay = 5;
  for (const bool known : {false, true}) {
    BaseMotion motion(DyrosPath());
    Sway(&motion, 0.03);
    BaseMotion late(DyrosPath());
    Sway(&late, 0.03);
    StateEstimatorConfig config;
    config.mutable_invariant_ekf()->set_sensor_delay(known ? kDelay * kTick : 0);
    InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion(config), kTick);
    double worst_position = 0, worst_turn = 0;
    for (int i = 0; i < 2000; ++i) {
      motion.Next();
      if (i < kDelay) continue;
      late.Next();
      estimator.Update(late.sensors(), kTick);
      const robot::RobotState& found = estimator.state();
      worst_position =
          std::max(worst_position, (found.base_position - motion.truth().base_position).norm());
      worst_turn = std::max(
          worst_turn, found.base_orientation.angularDistance(motion.truth().base_orientation));
    }
    if (known) {
      EXPECT_LT(worst_position, 1.5e-4);
      EXPECT_LT(worst_turn, 1e-4);
    } else {
      EXPECT_GT(worst_position, 5e-4);
      EXPECT_GT(worst_turn, 1e-3);
    }
  }
}

// Thrown up, no load on the feet: only the IMU knows, and the covariance says so.
TEST(InvariantEstimator, FlightIntegratesTheImuAndTheCovarianceGrows) {
  BaseMotion motion(DyrosPath());
  const Vector3d p = motion.start().base_position - Vector3d(0, 0, 0.06);
  const auto shift = [](double t) -> Vector3d {
    const double push = std::clamp(t - 0.2, 0.0, 0.2), fly = std::max(t - 0.4, 0.0);
    const Vector3d a(1, 0.5, 2);
    return a * (0.5 * push * push + 0.2 * fly) -
           0.5 * robot::kGravity * fly * fly * Vector3d::UnitZ();
  };
  motion.script().base_position = [=](double t) -> Vector3d { return p + shift(t); };
  for (size_t f = 0; f < 2; ++f) {
    const Isometry3d start = motion.script().foot[f](0);
    motion.script().foot[f] = [=](double t) {
      return Eigen::Translation3d(shift(std::max(t, 0.4)) - shift(0.4)) * start;
    };
    motion.script().load[f] = [](double t) { return t < 0.4 ? 0.5 : 0.0; };
  }
  motion.errors() = TypicalErrors(*motion.model());
  FollowMotion follow(&motion);
  follow.RunTo(0.42);
  const double known = follow.estimator().covariance()(3, 3);
  follow.RunTo(0.8);
  EXPECT_EQ(follow.estimator().contact(robot::Foot::kRight), FootContact::kNone);
  EXPECT_LT(follow.Error().segment<3>(3).norm(), 0.05);
  EXPECT_LT(follow.Error().tail<3>().norm(), 0.02);
  EXPECT_GT(follow.estimator().covariance()(3, 3), 4 * known);
}

// Any finite input gives a finite state, and what cannot be an IMU's reading is left out.
TEST(InvariantEstimator, FiniteGarbageGivesFiniteStates) {
  BaseMotion motion(MantisPath());
  const int n = motion.model()->num_joints();
  std::mt19937_64 random(TestSeed(3));
  const auto garbage = [&] { return AnyFinite(&random); };
  StateEstimatorConfig config;
  config.mutable_invariant_ekf()->set_gear_stiffness(7e4);
  config.mutable_invariant_ekf()->set_sensor_delay(0.002);
  for (int run = 0; run < 60; ++run) {
    InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion(config), kTick);
    Eigen::VectorXd q(n), torque(n);
    for (int i = 0; i < 200; ++i) {
      for (int j = 0; j < n; ++j) {
        q[j] = garbage();
        torque[j] = garbage();
      }
      const BaseSensors sensors = {
          {q.data(), n},
          Vector3d(garbage(), garbage(), garbage()),
          Vector3d(garbage(), garbage(), garbage()),
          {garbage(), garbage()},
          {Eigen::Vector2d(garbage(), garbage()), Eigen::Vector2d(garbage(), garbage())},
          {torque.data(), n}};
      estimator.Update(sensors, garbage());
      const robot::RobotState& s = estimator.state();
      ASSERT_TRUE(s.base_position.allFinite() && s.base_linear_velocity.allFinite() &&
                  s.base_angular_velocity.allFinite() && s.joint_velocity.allFinite() &&
                  s.joint_position.allFinite() && estimator.covariance().allFinite())
          << run << " " << i;
      ASSERT_NEAR(s.base_orientation.norm(), 1, 1e-12) << run << " " << i;
      for (const robot::Foot f : robot::kFeet) {
        ASSERT_TRUE(estimator.foot_pose(f).matrix().allFinite());
        ASSERT_TRUE(std::isfinite(estimator.innovation(f)));
      }
    }
  }
}

TEST(InvariantEstimator, ABurstOfImpossibleReadingsIsRiddenOut) {
  BaseMotion motion(DyrosPath());
  Sway(&motion, 0.01);
  InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion({}), kTick);
  double worst_after = 0;
  for (int i = 0; i < 3000; ++i) {
    motion.Next();
    BaseSensors sensors = motion.sensors();
    if (i >= 500 && i < 505) {
      sensors.angular_velocity.setConstant(1e300);
      sensors.acceleration.setConstant(-1e300);
    }
    estimator.Update(sensors, kTick);
    if (i < 600) continue;
    worst_after = std::max(worst_after, TiltError(estimator.state().base_orientation,
                                                  motion.truth().base_orientation));
  }
  EXPECT_LT(worst_after, 1e-3);
}

// A blow that the accelerometer sees wrongly: neither sole fits, but they do not move against each
// other. Soon it is found that they stand; what was wrong by then is the base's place.
TEST(InvariantEstimator, SolesThatMoveAlikeStand) {
  constexpr double kBlow = 50, kSeconds = 2 * kTick;  // m/s² too much, for so long
  constexpr double kRest = 0.05;                      // s in which it is found that they stand
  BaseMotion motion(DyrosPath());
  InvariantEstimator estimator(motion.model(), FollowMotion::AsTheMotion({}), kTick);
  bool both_slipped = false;
  for (int i = 0; i < 1000; ++i) {
    motion.Next();
    BaseSensors sensors = motion.sensors();
    if (i >= 500 && i < 502) sensors.acceleration.x() += kBlow;
    estimator.Update(sensors, kTick);
    both_slipped =
        both_slipped || (estimator.contact(robot::Foot::kRight) == FootContact::kSlipping &&
                         estimator.contact(robot::Foot::kLeft) == FootContact::kSlipping);
    if (i < 502 + 1.2 * kRest / kTick) continue;
    EXPECT_EQ(estimator.contact(robot::Foot::kRight), FootContact::kFirm) << i;
    EXPECT_EQ(estimator.contact(robot::Foot::kLeft), FootContact::kFirm) << i;
    ASSERT_LT(estimator.state().base_linear_velocity.norm(), 0.01) << i;
  }
  EXPECT_TRUE(both_slipped);
  const double way =
      (estimator.state().base_position - motion.truth().base_position).head<2>().norm();
  EXPECT_LT(way, kBlow * kSeconds * 1.2 * kRest);
}

// On a hoist for a minute, then put down: it begins again and finds its velocity.
TEST(InvariantEstimator, ComesBackAfterAMinuteInTheAir) {
  BaseMotion motion(DyrosPath());
  motion.errors() = TypicalErrors(*motion.model());
  motion.errors().accelerometer_bias = Vector3d(0.2, -0.1, 0.1);
  for (auto& load : motion.script().load) {
    load = [](double t) { return t < 1 || t > 61 ? 0.5 : 0.0; };
  }
  FollowMotion follow(&motion);
  follow.RunTo(60.5);
  EXPECT_GT(std::sqrt(follow.estimator().covariance()(6, 6)), 0.5);
  follow.RunTo(64);
  EXPECT_LT(follow.Error().segment<3>(3).norm(), 5e-3);
  EXPECT_LT(TiltError(follow.estimator().state().base_orientation, motion.truth().base_orientation),
            0.05);
}

}  // namespace
}  // namespace poise
