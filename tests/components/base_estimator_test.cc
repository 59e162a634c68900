#include "components/state_estimator/base_estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/components/base_motion.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kPeriod = BaseMotion::kPeriod;

std::string Dyros() {
  return std::string(POISE_SOURCE_DIR) + "/deploy/robots/dyros/dyros_legs.pbtxt";
}
// Rotated joint frames, tilted soles, arms, and the IMU above a waist joint.
std::string Mantis() { return std::string(POISE_SOURCE_DIR) + "/tests/robot/data/mantis.pbtxt"; }

struct Errors {
  double position = 0, velocity = 0, tilt = 0, yaw = 0, joint_velocity = 0;
};

class Follow {
 public:
  Follow(BaseMotion* motion, const StateEstimatorConfig& config = {})
      : motion_(*motion), estimator_(motion->model(), config, kPeriod) {}

  void Step() {
    motion_.Next();
    estimator_.Update(motion_.sensors(), kPeriod);
  }
  /// Runs to `time` and returns the largest errors from `from` on.
  Errors Run(double time, double from = 0) {
    Errors worst;
    while (motion_.time() < time - 1e-9) {
      Step();
      if (motion_.time() < from) continue;
      const Errors now = Difference();
      worst.position = std::max(worst.position, now.position);
      worst.velocity = std::max(worst.velocity, now.velocity);
      worst.tilt = std::max(worst.tilt, now.tilt);
      worst.yaw = std::max(worst.yaw, now.yaw);
      worst.joint_velocity = std::max(worst.joint_velocity, now.joint_velocity);
    }
    return worst;
  }
  Errors Difference() const {
    const robot::RobotState &estimate = estimator_.state(), &truth = motion_.truth();
    Errors e;
    e.position = (estimate.base_position - truth.base_position).norm();
    e.velocity = (estimate.base_linear_velocity - truth.base_linear_velocity).norm();
    e.tilt = TiltError(estimate.base_orientation, truth.base_orientation);
    e.yaw = estimate.base_orientation.angularDistance(truth.base_orientation);
    e.joint_velocity = (estimate.joint_velocity - truth.joint_velocity).cwiseAbs().maxCoeff();
    return e;
  }
  const BaseEstimator& estimator() const { return estimator_; }

 private:
  BaseMotion& motion_;
  BaseEstimator estimator_;
};

// What the bounds are made of.
constexpr double kLag =
    std::numbers::sqrt2 / (kTwoPi * 20) + kPeriod / 2;  // s, of the joint velocity filter
constexpr double kGravityShare =
    2.0 / (2 + 50);           // of the accelerometer's direction in the steady tilt
constexpr double kLeg = 0.9;  // m, base above the soles at most

class AnyRobot : public testing::TestWithParam<std::string> {
 protected:
  // 10 s of Sway; accelerations: body up to 0.17 + 0.11 + 0.1 m/s², 0.06 rad at 0.45 Hz up to 0.48
  // rad/s².
  static constexpr double kSway = 0.02, kAcceleration = 0.25, kTurnAcceleration = 0.55;
};

TEST_P(AnyRobot, FollowsExactReadings) {
  BaseMotion motion(GetParam());
  Sway(&motion, kSway);
  Follow follow(&motion);
  const Errors e = follow.Run(10);
  // The accelerometer takes its own acceleration for gravity, by its small share and for half a
  // period only.
  const double tilt = kGravityShare * (kAcceleration + kTurnAcceleration * kLeg) / robot::kGravity;
  EXPECT_LT(e.tilt, tilt);
  EXPECT_LT(e.yaw, tilt);
  EXPECT_LT(e.position, tilt * kLeg);
  EXPECT_LT(e.velocity, kLag * (kAcceleration + kTurnAcceleration * kLeg) + 2e-3);
}

TEST_P(AnyRobot, FollowsNoisyReadings) {
  BaseMotion motion(GetParam());
  Sway(&motion, kSway);
  SensorErrors& errors = motion.errors();
  errors = TypicalErrors(*motion.model());
  // Mantis has no noise of its own.
  errors.gyro_noise = 2e-4;
  errors.accelerometer_noise = 1.7e-2;
  errors.accelerometer_bias = 0.1 * Vector3d(1, -1, 1) / std::sqrt(3.0);
  errors.load_noise = 1;
  Follow follow(&motion);
  const Errors e = follow.Run(30);
  const double tilt =
      kGravityShare * (0.1 + kAcceleration + kTurnAcceleration * kLeg) / robot::kGravity;
  EXPECT_LT(e.tilt, tilt);  // FACTS of the controller: 0.01 rad is bearable
  EXPECT_LT(tilt, 0.01);
  // Twelve encoders between the soles and the base, each within half a step at a lever of at most
  // kLeg.
  const double step = kTwoPi / (36 * 4096);
  EXPECT_LT(e.position, tilt * kLeg + 12 * step / 2 * kLeg);
  EXPECT_LT(e.velocity, kLag * (kAcceleration + kTurnAcceleration * kLeg) + 4e-3);
}

TEST_P(AnyRobot, StartsWhereTheWorldsConventionPutsIt) {
  BaseMotion motion(GetParam());
  const Quaterniond turned =
      motion.start().base_orientation * AngleAxisd(0.1, Vector3d(0.6, 0.8, 0));
  const Vector3d moved = motion.start().base_position + Vector3d(0.02, 0.01, -0.03);
  motion.script().base_orientation = [=](double) { return turned; };
  motion.script().base_position = [=](double) { return moved; };
  Follow follow(&motion);
  follow.Step();
  // The soles stand level, side by side, their midpoint at the origin: the truth of BaseMotion.
  EXPECT_LT(follow.Difference().position, 1e-12);
  EXPECT_LT(follow.Difference().yaw, 1e-7);
  EXPECT_EQ(follow.estimator().state().base_linear_velocity.norm(), 0);
}

TEST_P(AnyRobot, GyroBiasIsFoundAndTakenOut) {
  BaseMotion motion(GetParam());
  const Vector3d bias(1e-4, -2e-4, 1.5e-4);
  Follow follow(&motion);
  follow.Run(1);
  motion.errors().gyro_bias = bias;  // drifts after the start, where rest shows it
  const Errors before = follow.Run(21);
  EXPECT_LT(before.yaw, bias.norm() * 2);  // never beyond bias × orientation_time_constant
  const Errors after = follow.Run(100, 100);
  EXPECT_LT((follow.estimator().gyro_bias() - bias).norm(), 0.01 * bias.norm());
  EXPECT_LT(after.yaw, 0.01 * before.yaw);
  EXPECT_LT(follow.estimator().state().base_angular_velocity.norm(), 0.01 * bias.norm());
}

// An ordinary gyro: its bias would turn the base by 4 mrad in orientation_time_constant, beyond
// what the stance foot is trusted for.
TEST_P(AnyRobot, AnOrdinaryGyroBiasIsKnownFromTheStart) {
  for (const double right_load : {0.5, 1.0}) {
    for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, -1, 0), Vector3d(0.6, 0.5, -0.6)}) {
      SCOPED_TRACE(testing::PrintToString(right_load) + " " + testing::PrintToString(axis.x()));
      BaseMotion motion(GetParam());
      motion.script().load = {[=](double) { return right_load; },
                              [=](double) { return 1 - right_load; }};
      motion.errors().gyro_bias = 2e-3 * axis;
      motion.errors().gyro_noise = 2e-4;
      motion.errors().encoder_steps = true;
      Follow follow(&motion);
      const Errors e = follow.Run(20);
      EXPECT_LT(e.tilt, 0.002);
      EXPECT_LT((follow.estimator().gyro_bias() - 2e-3 * axis).norm(), 2e-4);
    }
  }
}

// The mean of 0.2 s is ten times better than one reading; a motion spoils it, not the first one.
TEST(BaseEstimator, TheBiasAtRestIsAMeanUnlessTheRobotMoves) {
  const Vector3d bias(1e-3, -2e-3, 1.5e-3);
  for (const bool moves : {false, true}) {
    BaseMotion motion(Dyros());
    if (moves) {
      const Vector3d p = motion.start().base_position;
      motion.script().base_position = [=](double t) -> Vector3d {
        return p + Vector3d(0.02 * Ramp(t, 0.05, 0.3), 0, 0);
      };
    }
    motion.errors().gyro_bias = bias;
    motion.errors().gyro_noise = 1e-3;
    Follow follow(&motion);
    follow.Step();
    const Vector3d first = follow.estimator().gyro_bias();
    EXPECT_GT((first - bias).norm(), 2e-4);
    follow.Run(0.25);
    if (moves) {
      EXPECT_LT((follow.estimator().gyro_bias() - first).norm(), 1e-4);
    } else {
      EXPECT_LT((follow.estimator().gyro_bias() - bias).norm(), 4 * 1e-3 * std::sqrt(3.0 / 100));
      EXPECT_GT((follow.estimator().gyro_bias() - first).norm(), 1e-4);
    }
  }
}

TEST(BaseEstimator, ATurnAtTheStartIsNoBias) {
  BaseMotion motion(Dyros());
  motion.errors().gyro_bias = Vector3d(0, 0.3, 0);
  Follow follow(&motion);
  follow.Step();
  EXPECT_EQ(follow.estimator().gyro_bias(), Vector3d::Zero());
}

INSTANTIATE_TEST_SUITE_P(Robots, AnyRobot, testing::Values(Dyros(), Mantis()),
                         [](const auto& test) {
                           return test.param == Dyros() ? "Dyros" : "Mantis";
                         });

TEST(BaseEstimator, AStepUpKeepsTheBaseContinuousAndAnchorsTheFootWhereItLands) {
  BaseMotion motion(Dyros());
  StepUp(&motion);
  motion.errors() = TypicalErrors(*motion.model());
  Follow follow(&motion);
  follow.Step();
  const double tilt = kGravityShare * (0.1 + 0.5) / robot::kGravity;
  // One tick may differ from the truth by the encoders' steps only.
  const double jump = 12 * kTwoPi / (50 * 8192) * kLeg;
  Vector3d last = follow.estimator().state().base_position - motion.truth().base_position;
  while (motion.time() < 8) {
    follow.Step();
    const Vector3d error = follow.estimator().state().base_position - motion.truth().base_position;
    ASSERT_LT((error - last).norm(), jump) << motion.time();
    ASSERT_LT(error.norm(), tilt * kLeg + jump) << motion.time();
    last = error;
    const double t = motion.time();
    const auto& weight = follow.estimator().foot_weight();
    if (t > 1.3 && t < 2.7) {
      ASSERT_EQ(weight[1], 0) << t;
      ASSERT_EQ(weight[0], 1) << t;
    }
    ASSERT_NEAR(weight[0] + weight[1], 1, 1e-12) << t;
  }
  const Eigen::Isometry3d landed = motion.script().foot[1](8);
  EXPECT_GT(landed.translation().z(), 0.0499);
  EXPECT_LT(
      (follow.estimator().anchor(robot::Foot::kLeft).translation() - landed.translation()).norm(),
      2 * tilt * kLeg + jump);
  EXPECT_GT(follow.estimator().foot_weight()[1], 0.75);
}

TEST(BaseEstimator, ALightFootIsFollowedAndNotTrusted) {
  BaseMotion motion(Dyros());
  motion.script().load = {[](double) { return 0.96; }, [](double) { return 0.04; }};
  const Eigen::Isometry3d start = motion.script().foot[1](0);
  motion.script().foot[1] = [=](double t) {
    Eigen::Isometry3d foot = start;
    foot.translation() += Vector3d(0.05, 0.02, 0.08) * Ramp(t, 0, 1);
    foot.linear() = AngleAxisd(0.2 * Ramp(t, 0, 1), Vector3d::UnitY()).toRotationMatrix();
    return foot;
  };
  Follow follow(&motion);
  const Errors e = follow.Run(2);
  EXPECT_LT(e.position, 1e-6);
  EXPECT_LT(e.tilt, 1e-6);
  const Eigen::Isometry3d foot = motion.script().foot[1](2);
  EXPECT_LT(
      (follow.estimator().anchor(robot::Foot::kLeft).translation() - foot.translation()).norm(),
      1e-6);
  EXPECT_LT((follow.estimator().anchor(robot::Foot::kLeft).linear() - foot.linear()).norm(), 1e-6);
}

// Both feet carry the same; the ground under the left one gives way by 20 mm and tilts.
TEST(BaseEstimator, AFootMaySinkIntoSoftGround) {
  BaseMotion motion(Dyros());
  const Eigen::Isometry3d start = motion.script().foot[1](0);
  motion.script().foot[1] = [=](double t) {
    Eigen::Isometry3d foot = start;
    foot.translation().z() -= 0.02 * Ramp(t, 0.5, 1.5);
    foot.linear() = AngleAxisd(0.05 * Ramp(t, 0.5, 1.5), Vector3d::UnitX()).toRotationMatrix();
    return foot;
  };
  // Then the weight goes to the sunk foot alone, and the other one lifts.
  motion.script().load[0] = [](double t) { return 0.5 * (1 - Ramp(t, 5, 6)); };
  motion.script().load[1] = [load = motion.script().load[0]](double t) { return 1 - load(t); };
  Follow follow(&motion);
  Vector3d last = Vector3d::Zero();
  double worst_jump = 0, worst_tilt = 0, worst_tilt_late = 0;
  while (motion.time() < 8) {
    follow.Step();
    const Vector3d error = follow.estimator().state().base_position - motion.truth().base_position;
    worst_jump = std::max(worst_jump, (error - last).norm());
    last = error;
    worst_tilt = std::max(worst_tilt, follow.Difference().tilt);
    if (motion.time() < 4.5) continue;
    worst_tilt_late = std::max(worst_tilt_late, follow.Difference().tilt);
    // The two feet agree again on where the base is (five time constants later).
    for (const robot::Foot f : robot::kFeet) {
      const double gap = (follow.estimator().foot_pose(f).translation() -
                          follow.estimator().anchor(f).translation())
                             .norm();
      ASSERT_LT(gap, 0.02 * std::exp(-5)) << motion.time();
    }
  }
  // The base stands still in truth. Half of what one foot sinks in a tick (at 37.5 mm/s at most) is
  // all it may move.
  EXPECT_LT(worst_jump, 0.5 * 0.0375 * kPeriod * 1.1);
  // Which foot sinks cannot be known: the mean is the best guess.
  EXPECT_NEAR(last.norm(), 0.01, 0.002);
  EXPECT_LT(worst_tilt, 0.01);
  EXPECT_LE(worst_tilt_late, worst_tilt);
}

// Thrown up and turning, no load on the feet: only the IMU knows.
TEST(BaseEstimator, FlightIntegratesTheImu) {
  for (const std::string& path : {Dyros(), Mantis()}) {
    BaseMotion motion(path);
    // Knees well bent: near their straight end joint rates, and their lag, grow without bound.
    const Vector3d p = motion.start().base_position - Vector3d(0, 0, 0.06);
    const Quaterniond q = motion.start().base_orientation;
    const auto shift = [=](double t) -> Vector3d {
      // Stands until 0.2 s, pushes off until 0.4 s, then a parabola.
      const double push = std::clamp(t - 0.2, 0.0, 0.2), fly = std::max(t - 0.4, 0.0);
      const Vector3d a(1, 0.5, 2);
      return a * (0.5 * push * push + 0.2 * fly) -
             0.5 * robot::kGravity * fly * fly * Vector3d::UnitZ();
    };
    motion.script().base_position = [=](double t) -> Vector3d { return p + shift(t); };
    const auto turn = [=](double t) {
      const double fly = std::max(t - 0.4, 0.0);
      return AngleAxisd(1.5 * fly * fly * fly, Vector3d(0.6, 0, 0.8));
    };
    motion.script().base_orientation = [=](double t) { return Quaterniond(turn(t)) * q; };
    for (size_t f = 0; f < 2; ++f) {
      const Eigen::Isometry3d start = motion.script().foot[f](0);
      // Taken along in the air.
      motion.script().foot[f] = [=](double t) {
        const Vector3d moved = shift(std::max(t, 0.4)) - shift(0.4);
        return Eigen::Translation3d(moved) * start;
      };
      motion.script().load[f] = [=](double t) { return t < 0.4 ? 0.5 : 0.0; };
    }
    Follow follow(&motion);
    follow.Run(0.4);
    const Errors at_takeoff = follow.Difference();
    const Errors e = follow.Run(0.8, 0.42);
    EXPECT_EQ(follow.estimator().foot_weight()[0] + follow.estimator().foot_weight()[1], 0);
    // The velocity at take-off lags the last push by the filter; the flight keeps that error and
    // adds none.
    // Joint rates change with the body's acceleration, 2.3 m/s², and with the knees' turning, v² /
    // 0.3 m.
    const double lagged = kLag * (2.3 + 0.46 * 0.46 / 0.3) + 0.005;
    EXPECT_LT(at_takeoff.velocity, lagged);
    EXPECT_LT(e.velocity, lagged + 0.005);
    EXPECT_LT(e.position, lagged * 0.4 + 0.005);
    EXPECT_LT(e.tilt, 1e-3);
  }
}

TEST(BaseEstimator, WithoutLoadAtFirstTheLowerFootStands) {
  BaseMotion motion(Dyros());
  motion.script().load = {[](double t) { return t > 0 ? 1.0 : 0.0; }, [](double) { return 0.0; }};
  const Eigen::Isometry3d start = motion.script().foot[1](0);
  motion.script().foot[1] = [=](double) { return Eigen::Translation3d(0, 0, 0.05) * start; };
  Follow follow(&motion);
  follow.Step();
  EXPECT_LT(follow.Difference().position, 1e-9);
  EXPECT_LT(follow.Difference().yaw, 1e-7);
  EXPECT_EQ(follow.estimator().foot_weight()[0], 0);
  const Errors e = follow.Run(2);
  EXPECT_LT(e.position, 1e-6);
  EXPECT_EQ(follow.estimator().foot_weight()[0], 1);
}

TEST(BaseEstimator, FiniteGarbageGivesFiniteStates) {
  BaseMotion motion(Mantis());
  const int n = motion.model()->num_joints();
  std::mt19937_64 random(TestSeed(3));
  const auto garbage = [&] { return AnyFinite(&random); };
  for (int run = 0; run < 200; ++run) {
    BaseEstimator estimator(motion.model(), {}, kPeriod);
    Eigen::VectorXd q(n);
    for (int i = 0; i < 200; ++i) {
      for (int j = 0; j < n; ++j) q[j] = garbage();
      const BaseSensors sensors = {{q.data(), n},
                                   Vector3d(garbage(), garbage(), garbage()),
                                   Vector3d(garbage(), garbage(), garbage()),
                                   {garbage(), garbage()}};
      estimator.Update(sensors, garbage());
      const robot::RobotState& s = estimator.state();
      ASSERT_TRUE(s.base_position.allFinite() && s.base_linear_velocity.allFinite() &&
                  s.base_angular_velocity.allFinite() && s.joint_velocity.allFinite() &&
                  estimator.gyro_bias().allFinite())
          << run << " " << i;
      ASSERT_NEAR(s.base_orientation.norm(), 1, 1e-12) << run << " " << i;
      for (const robot::Foot f : robot::kFeet) {
        ASSERT_TRUE(estimator.anchor(f).matrix().allFinite());
        const double w = estimator.foot_weight()[f];
        ASSERT_TRUE(w >= 0 && w <= 1);
      }
    }
  }
}

TEST(BaseEstimator, RecoversFromABurstOfGarbage) {
  BaseMotion motion(Dyros());
  Sway(&motion, 0.01);
  BaseEstimator estimator(motion.model(), {}, kPeriod);
  for (int i = 0; i < 30000; ++i) {
    motion.Next();
    BaseSensors sensors = motion.sensors();
    if (i >= 500 && i < 505) {
      sensors.angular_velocity.setConstant(1e300);
      sensors.acceleration.setConstant(-1e300);
    }
    estimator.Update(sensors, kPeriod);
  }
  // The stance feet have led the orientation back.
  EXPECT_LT(TiltError(estimator.state().base_orientation, motion.truth().base_orientation), 2e-3);
}

// Against the transfer function of the second-order Butterworth filter.
TEST(LowPass, HasTheGainAndPhaseOfAButterworthFilter) {
  constexpr double kCutoff = 20, kStep = 1e-4;
  for (const double frequency : {2.0, 10.0, 20.0, 40.0, 100.0}) {
    LowPass filter(1, kCutoff);
    const double r = frequency / kCutoff;
    const double gain = 1 / std::sqrt(1 + r * r * r * r);
    const double phase = -std::atan2(std::numbers::sqrt2 * r, 1 - r * r);
    for (int i = 1; i < 20000; ++i) {
      // The input is held over the step: its value in the middle.
      filter.Step(Eigen::VectorXd::Constant(1, std::sin(kTwoPi * frequency * (i - 0.5) * kStep)),
                  kStep);
      if (i < 10000) continue;
      const double expected = gain * std::sin(kTwoPi * frequency * i * kStep + phase);
      ASSERT_NEAR(filter.value()[0], expected, 2e-3 * gain) << frequency;
    }
  }
}

TEST(LowPass, IsStableAndUnbiasedForAnyStep) {
  for (const double step : {1e-5, 0.002, 0.02, 1.0, 100.0}) {
    LowPass filter(2, 20);
    for (int i = 0; i < 200000; ++i) filter.Step(Eigen::Vector2d(1, -3), step);
    EXPECT_NEAR(filter.value()[0], 1, 1e-2) << step;
    EXPECT_NEAR(filter.value()[1], -3, 3e-2) << step;
  }
}

// Rounding to counts is noise of step / √12; its difference quotient over a period is √2 step /
// (√12 period). White noise of that size, differenced, has after the filter the share given by the
// integral of |H|² (2 sin(ω T / 2))² / 2.
TEST(BaseEstimator, JointVelocityNoiseOfTheEncodersIsFiltered) {
  BaseMotion motion(Dyros());
  Sway(&motion, 0.02);
  Follow exact_follow(&motion);
  BaseMotion stepped(Dyros());
  Sway(&stepped, 0.02);
  stepped.errors().encoder_steps = true;
  Follow stepped_follow(&stepped);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < 5000; ++i) {
    exact_follow.Step();
    stepped_follow.Step();
    if (i < 500) continue;
    sum += (stepped_follow.estimator().state().joint_velocity -
            exact_follow.estimator().state().joint_velocity)
               .squaredNorm();
    count += motion.model()->num_joints();
  }
  const double step = kTwoPi / (50 * 8192);
  double share = 0;  // of the variance of the differences
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    const double f = (i + 0.5) / kPoints * 0.5 / kPeriod, r = f / 20;
    const double s = 2 * std::sin(std::numbers::pi * f * kPeriod);
    share += s * s / 2 / (1 + r * r * r * r) / kPoints;
  }
  const double raw = std::numbers::sqrt2 * step / std::sqrt(12) / kPeriod;
  EXPECT_NEAR(std::sqrt(sum / count), raw * std::sqrt(share), 0.25 * raw * std::sqrt(share));
  EXPECT_LT(std::sqrt(sum / count), 0.1 * raw);
}

}  // namespace
}  // namespace poise
