// The wrench observer against closed forms and against the equations of motion in drawn motions;
// the calibrator against loads put on the model; the check of the feet's sensors.
#include "components/state_estimator/wrench_observer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "components/state_estimator/calibrator.h"
#include "components/state_estimator/foot_wrenches.h"
#include "tests/robot/robot_test_support.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using robot::RobotModel;
using robot::TestRobot;

constexpr double kPeriod = 0.002;

/// Readings and the wrenches that go with them, of a robot in a motion of its own: joints and base
/// swing slowly against the friction of the robot's file, the ground exerts what the motion asks
/// for, shared between the feet by `share`, and something else pushes the base with `push`, [force;
/// moment about the base's origin], base frame.
class Motion {
 public:
  Motion(TestRobot robot, double amplitude, double rate = 2)
      : model_(std::make_shared<RobotModel>(robot::LoadTestRobot(robot))),
        amplitude_(amplitude),
        rate_(rate),
        state_(model_->num_joints()),
        data_(*model_),
        acceleration_(VectorXd::Zero(model_->num_velocities())),
        held_(VectorXd::Zero(model_->num_joints())) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> phase(0, 6);
    for (int i = 0; i < model_->num_velocities(); ++i) phase_.push_back(phase(random));
  }

  /// The left leg's joints have this share more friction and torque than the robot's file says.
  void SetLegError(double friction, double torque) {
    friction_error_ = friction;
    torque_error_ = torque;
  }

  /// `t` grows from call to call, in steps that are short beside the motion.
  void At(double t, double share, const robot::Vector6d& push = robot::Vector6d::Zero()) {
    const int n = model_->num_joints();
    const double rate = rate_;  // rad/s
    const VectorXd before = state_.joint_position;
    for (int j = 0; j < n; ++j) {
      const double p = phase_[static_cast<size_t>(j)] + rate * t;
      state_.joint_position[j] = 0.2 * std::sin(j + 1.0) + amplitude_ * std::sin(p);
      state_.joint_velocity[j] = amplitude_ * rate * std::cos(p);
      acceleration_[6 + j] = -amplitude_ * rate * rate * std::sin(p);
    }
    // Turning about one axis, so that rate and acceleration are the angle's.
    const Vector3d axis = Vector3d(1, 2, 0.5).normalized();
    state_.base_orientation = Eigen::AngleAxisd(0.3 * amplitude_ * std::sin(rate * t), axis);
    state_.base_angular_velocity = axis * 0.3 * amplitude_ * rate * std::cos(rate * t);
    acceleration_.segment<3>(3) = -axis * 0.3 * amplitude_ * rate * rate * std::sin(rate * t);
    acceleration_.head<3>() =
        amplitude_ * Vector3d(std::sin(rate * t), std::cos(rate * t), 0.5 * std::sin(rate * t + 1));
    data_ = robot::Evaluate(*model_, state_);

    VectorXd force(model_->num_velocities());
    robot::InverseDynamics(*model_, state_, data_, acceleration_, force);
    // Base rows: the ground's share is what nobody else gives.
    robot::Vector6d rest = force.head<6>();
    rest.head<3>() -= data_.body_rotation[0] * push.head<3>();
    rest.tail<3>() -= data_.body_rotation[0] * push.tail<3>();
    torque_ = force.tail(n);
    for (int j = 0; j < n; ++j) {
      const robot::MotorModel& motor = model_->motors()[static_cast<size_t>(j)];
      if (moved_) held_[j] = Dahl(motor, held_[j], state_.joint_position[j] - before[j]);
      const double friction = held_[j] + motor.viscous_friction * state_.joint_velocity[j];
      torque_[j] += friction * (InLeftLeg(j) ? 1 + friction_error_ : 1);
    }
    moved_ = true;
    for (size_t f = 0; f < 2; ++f) {
      const Vector3d point = data_.foot_pose[f].translation() - data_.base_position;
      const double part = f == 0 ? share : 1 - share;
      robot::Vector6d world;
      world.head<3>() = part * rest.head<3>();
      world.tail<3>() = part * rest.tail<3>() - point.cross(world.head<3>());
      torque_ -= data_.foot_jacobian[f].rightCols(n).transpose() * world;
      const Eigen::Matrix3d to_sole = data_.foot_pose[f].linear().transpose();
      wrench_[f] << to_sole * world.head<3>(), to_sole * world.tail<3>();
    }
    for (int j = 0; j < n; ++j) {
      if (InLeftLeg(j)) torque_[j] *= 1 + torque_error_;
    }
    const robot::ImuModel& imu = model_->imu();
    const auto b = static_cast<size_t>(imu.body);
    const Eigen::Matrix3d to_imu = (data_.body_rotation[b] * imu.pose.linear()).transpose();
    const Vector3d arm = data_.body_rotation[b] * imu.pose.translation();
    Vector3d alpha = data_.body_angular_bias[b] + acceleration_.segment<3>(3);
    Vector3d linear = data_.body_linear_bias[b] + acceleration_.head<3>() +
                      acceleration_.segment<3>(3).cross(data_.body_position[b]);
    for (const int j : model_->supporting_joints(imu.body)) {
      const auto i = static_cast<size_t>(j);
      const Vector3d spin = data_.joint_axis[i] * acceleration_[6 + j];
      alpha += spin;
      linear += spin.cross(data_.body_position[b] - data_.body_position[i + 1]);
    }
    const Vector3d& w = data_.body_angular_velocity[b];
    gyro_ = to_imu * w;
    force_ = to_imu * (linear + alpha.cross(arm) + w.cross(w.cross(arm)) +
                       robot::kGravity * Vector3d::UnitZ());
  }

  BaseSensors sensors() const {
    return {{state_.joint_position.data(), state_.joint_position.size()},
            gyro_,
            force_,
            {},
            {},
            {torque_.data(), torque_.size()}};
  }
  std::shared_ptr<const RobotModel> model() const { return model_; }
  /// Robot on environment, as the observer gives it.
  WrenchObserver::Wrenches wrenches() const {
    WrenchObserver::Wrenches all;
    all << -wrench_[0], -wrench_[1];
    return all;
  }
  double weight() const { return model_->total_mass() * robot::kGravity; }

 private:
  bool InLeftLeg(int joint) const {
    return std::ranges::count(model_->supporting_joints(model_->feet()[1].body), joint) > 0;
  }
  /// Dahl's dF/dq = σ (1 − F sgn(dq) / F_c) in small steps.
  static double Dahl(const robot::MotorModel& motor, double held, double way) {
    const double limit = motor.coulomb_friction;
    if (!(limit > 0)) return 0;
    constexpr int kSteps = 100;
    const double sign = way < 0 ? -1 : 1;
    constexpr double kStiffness = 1e4;  // N·m/rad, as the observer takes it
    for (int i = 0; i < kSteps; ++i) held += kStiffness * (1 - sign * held / limit) * way / kSteps;
    return held;
  }

  std::shared_ptr<const RobotModel> model_;
  double amplitude_, rate_;
  robot::RobotState state_;
  robot::RobotData data_;
  VectorXd acceleration_, torque_, held_;
  bool moved_ = false;
  double friction_error_ = 0, torque_error_ = 0;
  std::vector<double> phase_;
  std::array<robot::Vector6d, 2> wrench_;
  Vector3d gyro_, force_;
};

// At rest the filter is exact, and so are the rows: 18 and more equations without an error.
TEST(WrenchObserver, AtRestItGivesTheStaticWrenchesToRounding) {
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    for (const double share : {0.5, 0.8, 1.0}) {
      Motion motion(robot, 0);
      WrenchObserver observer(motion.model());
      motion.At(0, share);
      observer.Track(motion.sensors(), kPeriod);
      ASSERT_TRUE(observer.Observe({}));
      // The prior, which makes it solvable on one straight leg, is worth little beside the rows.
      EXPECT_LT((observer.wrenches() - motion.wrenches()).norm(), 1e-3 * motion.weight());
      // The least cost of prior, rows and base is not above the truth's, which is the prior's alone
      // (2 weights a force, 0.3 a moment), and the excess is what the base's rows add to it.
      double prior = 0;
      for (int i = 0; i < 12; ++i) {
        const double deviation = (i % 6 < 3 ? 2 : 0.3) * motion.weight();
        prior += std::pow(motion.wrenches()[i] / deviation, 2);
      }
      EXPECT_LE(observer.push_excess(), prior);
      EXPECT_LT(prior, 1);
    }
  }
}

// The sum of what the feet exert is the rate of the momentum less gravity, whatever moves.
TEST(WrenchObserver, InMotionItFollowsTheEquationsOfMotion) {
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    Motion motion(robot, 0.1);
    WrenchObserver observer(motion.model(), 100);
    double worst = 0;
    for (int tick = 0; tick < 1500; ++tick) {
      const double t = kPeriod * tick;
      motion.At(t, 0.5 + 0.3 * std::sin(t));
      observer.Track(motion.sensors(), kPeriod);
      ASSERT_TRUE(observer.Observe({}));
      if (tick < 50) continue;
      // 2 rad/s through a filter that lags by 2 ms: 0.5 % of what changes.
      worst = std::max(worst, (observer.wrenches() - motion.wrenches()).norm());
    }
    EXPECT_LT(worst, 0.02 * motion.weight());
  }
}

// A foot that swings carries nothing, by which the leg's errors become known: friction 40 % and
// torque 3 % off. When it then touches down at 600 N/s, 10 N are seen as soon as the low-pass lets
// them: 5.6 ms, √2/ω, and what is left of the error.
TEST(WrenchObserver, ASwingingFootTeachesItsLegAndATouchIsSeenInTime) {
  double error[2], deviation[2], late[2];
  for (const bool learn : {false, true}) {
    Motion motion(TestRobot::kDyros, 0.5, 0.3);  // so slow that few joints turn back
    motion.SetLegError(0.4, 0.03);
    WrenchObserver observer(motion.model());
    double squares = 0, touched = -1, seen = -1;
    int count = 0;
    for (int tick = 0; tick < 1600; ++tick) {
      const double t = kPeriod * tick;
      const double load = std::max(600 * (t - 3), 0.0);
      motion.At(t, 1 - load / motion.weight());
      observer.Track(motion.sensors(), kPeriod);
      ASSERT_TRUE(observer.Observe({}, learn));
      const double truth = -motion.wrenches()[8], observed = -observer.wrenches()[8];
      if (t > 1 && t < 3) {
        squares += std::pow(observed - truth, 2);
        ++count;
        ASSERT_EQ(observer.free(robot::Foot::kLeft), learn) << t;
        ASSERT_FALSE(observer.free(robot::Foot::kRight)) << t;
        deviation[learn] = std::sqrt(observer.settled_covariance()(8, 8));
        ASSERT_TRUE(!learn || observed < 10) << t << ": a false touch";
      }
      if (t < 3) continue;
      if (touched < 0 && truth > 10) touched = t;
      if (seen < 0 && observed > std::max(10.0, 3 * deviation[learn])) seen = t;
    }
    error[learn] = std::sqrt(squares / count);
    ASSERT_GT(touched, 0);
    ASSERT_GT(seen, 0);
    late[learn] = seen - touched;
    EXPECT_FALSE(observer.free(robot::Foot::kLeft)) << "it stands again";
  }
  EXPECT_LT(error[1], 0.5 * error[0]);
  EXPECT_LT(deviation[1], 0.5 * deviation[0]);
  EXPECT_LE(late[1], 0.01);
  EXPECT_GT(late[0], 0.01) << "three deviations of what is not known take longer";
}

// A push on the base is none of the feet's: the base's rows disagree, and lose their weight.
TEST(WrenchObserver, APushOnTheBaseIsNotTakenForTheFeet) {
  Motion motion(TestRobot::kDyros, 0);
  robot::Vector6d push;
  push << 30, 300, 0, -60, 0, 20;
  for (const double scale : {1.0, 2.0, 4.0}) {
    WrenchObserver observer(motion.model());
    motion.At(0, 0.5, scale * push);
    observer.Track(motion.sensors(), kPeriod);
    ASSERT_TRUE(observer.Observe({}));
    EXPECT_GT(observer.push_excess(), 100);
    // The base's rows keep (gate / excess)² of their weight, 1e-4. What is left is the prior's pull
    // where the legs' rows tell least: the error's square in the covariance is at most the truth's
    // cost, prior and reduced rows together; seen were 0.07 to 0.33.
    const WrenchObserver::Wrenches error = observer.wrenches() - motion.wrenches();
    EXPECT_LT(error.dot(observer.covariance().llt().solve(error)), 1);
    EXPECT_LT(error.norm(), 0.1 * scale * push.norm());
  }
}

// Without torques nothing but the sum is known: it is given, and the covariance says so.
TEST(WrenchObserver, WithoutTorquesTheSumOfBothFeetIsKnown) {
  Motion motion(TestRobot::kDyros, 0);
  WrenchObserver observer(motion.model());
  motion.At(0, 0.7);
  const BaseSensors read = motion.sensors();
  const BaseSensors without = {
      read.joint_position, read.angular_velocity, read.acceleration, {}, {}};
  observer.Track(without, kPeriod);
  ASSERT_TRUE(observer.Observe({}));
  EXPECT_FALSE(observer.torque_known());
  const auto sum = [](const WrenchObserver::Wrenches& w) { return w[2] + w[8]; };
  EXPECT_NEAR(sum(observer.wrenches()), sum(motion.wrenches()), 0.01 * motion.weight());
  EXPECT_GT(std::sqrt(observer.covariance()(2, 2)), 0.3 * motion.weight());
}

// Friction drawn as the settings say, in joints that have not slipped yet; torque and mass as well.
TEST(WrenchObserver, TheCovarianceIsThatOfTheErrors) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int inside = 0;
  constexpr int kTrials = 400;
  Motion motion(TestRobot::kDyros, 0);
  motion.At(0, 0.6);
  VectorXd torque(motion.model()->num_joints());
  for (int trial = 0; trial < kTrials; ++trial) {
    WrenchObserver observer(motion.model());
    const BaseSensors read = motion.sensors();
    for (Eigen::Index j = 0; j < torque.size(); ++j) {
      const double stuck =
          motion.model()->motors()[static_cast<size_t>(j)].static_friction / std::sqrt(3.0);
      torque[j] = read.joint_torque[j] * (1 + 0.02 * normal(random)) + stuck * normal(random);
    }
    const BaseSensors noisy = {
        read.joint_position,           read.angular_velocity, read.acceleration, {}, {},
        {torque.data(), torque.size()}};
    observer.Track(noisy, kPeriod);
    ASSERT_TRUE(observer.Observe({}));
    const WrenchObserver::Wrenches error = observer.wrenches() - motion.wrenches();
    inside += error.dot(observer.covariance().llt().solve(error)) < 21.03 ? 1 : 0;
  }
  // 0.95 when the covariance is right; here the base's rows have no error, so rather more.
  EXPECT_GE(inside, static_cast<int>(0.93 * kTrials));
}

TEST(Calibrator, FindsALoadAndTheComInTwoSeconds) {
  Motion motion(TestRobot::kDyros, 0.02);
  // The robot carries less than its model says, so that the model's mass is an error to find.
  const RobotModel heavier = motion.model()->WithModelError(motion.model()->bodies()[0].name, 1.1,
                                                            Vector3d(0.02, -0.015, 0.01));
  const auto believed = std::make_shared<RobotModel>(heavier);
  const robot::Body& was = motion.model()->bodies()[0];
  const robot::Body& is = believed->bodies()[0];
  Calibrator::Load expected;
  expected << was.mass - is.mass, was.mass * was.com - is.mass * is.com;
  WrenchObserver observer(believed);
  Calibrator calibrator(believed, true, kPeriod);
  for (int tick = 0; tick < 1000; ++tick) {
    motion.At(kPeriod * tick, 0.5);
    observer.Track(motion.sensors(), kPeriod);
    ASSERT_TRUE(observer.Observe({}));
    const WrenchObserver::Wrenches w = motion.wrenches();
    calibrator.Track({w.head<6>(), w.tail<6>()}, kPeriod);
    calibrator.Update(observer, true);
  }
  const double mass = believed->total_mass();
  EXPECT_TRUE(calibrator.running());
  EXPECT_NEAR(calibrator.load()[0], expected[0], 0.01 * mass);
  for (const int axis : {1, 2}) {
    EXPECT_NEAR(calibrator.load()[axis], expected[axis], 0.005 * mass) << axis;
  }
  // The height shows in the sway alone, and less.
  EXPECT_GT(calibrator.covariance()(3, 3), 4 * calibrator.covariance()(1, 1));
}

// Standing still nothing tells the height of the COM; the covariance keeps what was assumed.
TEST(Calibrator, StandingStillTheHeightIsNotSeen) {
  Motion motion(TestRobot::kDyros, 0);
  WrenchObserver observer(motion.model());
  Calibrator calibrator(motion.model(), true, kPeriod);
  const double before = calibrator.covariance()(3, 3);
  motion.At(0, 0.5);
  const WrenchObserver::Wrenches w = motion.wrenches();
  for (int tick = 0; tick < 1000; ++tick) {
    observer.Track(motion.sensors(), kPeriod);
    ASSERT_TRUE(observer.Observe({}));
    calibrator.Track({w.head<6>(), w.tail<6>()}, kPeriod);
    calibrator.Update(observer, true);
  }
  EXPECT_GE(calibrator.covariance()(3, 3), before);
  EXPECT_LT(calibrator.covariance()(1, 1), 1e-3 * before);
}

struct Fault {
  const char* name;
  FootSensorCheck::State state;
  robot::Vector6d (*broken)(const robot::Vector6d& right, const robot::Vector6d& first);
};
class FootSensorFault : public testing::TestWithParam<Fault> {};

// The load moves from foot to foot; from 1 s to 3 s one sensor is broken.
TEST_P(FootSensorFault, IsNoticedNamedAndForgiven) {
  Motion motion(TestRobot::kDyros, 0);
  FootWrenches wrenches(motion.model());
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  robot::Vector6d first = robot::Vector6d::Zero();
  for (int tick = 0; tick < 2500; ++tick) {
    const double t = kPeriod * tick;
    motion.At(0, 0.5 + 0.3 * std::sin(2 * t));
    std::array<FootReading, 2> reading;
    const WrenchObserver::Wrenches truth = motion.wrenches();
    for (size_t f = 0; f < 2; ++f) {
      reading[f].wrench = truth.segment<6>(static_cast<Eigen::Index>(6 * f));
      for (int i = 0; i < 6; ++i) reading[f].wrench[i] += (i < 3 ? 1.0 : 0.05) * normal(random);
    }
    const bool broken = t >= 1 && t < 3;
    if (!broken) first = reading[1].wrench;
    if (broken) reading[1].wrench = GetParam().broken(reading[1].wrench, first);
    wrenches.Update(tick, kPeriod, motion.sensors(), reading, {});
    ASSERT_TRUE(wrenches.measured(robot::Foot::kRight)) << t;
    ASSERT_TRUE(t >= 1 || wrenches.measured(robot::Foot::kLeft)) << t;
    if (t > 1.6 && t < 3) {
      ASSERT_EQ(wrenches.check(robot::Foot::kLeft).state(), GetParam().state) << t;
      ASSERT_LT((wrenches.wrench(robot::Foot::kLeft) - truth.tail<6>()).norm(),
                0.03 * motion.weight())
          << t;
    }
  }
  EXPECT_TRUE(wrenches.measured(robot::Foot::kLeft)) << "well again for 2 s";
}

// A sole that comes off the ground and strikes it again, up to 125 times a second: a good sensor
// reads every blow, the observer's low-pass a mean. A bias is noticed as before once it rests.
TEST(FootSensorCheck, ASoleThatRattlesIsNoFault) {
  Motion motion(TestRobot::kDyros, 0);
  const std::array<std::pair<int, int>, 4> rattles = {{{4, 2}, {8, 2}, {16, 4}, {30, 10}}};
  for (const auto& [period, contact] : rattles) {  // ticks
    FootWrenches wrenches(motion.model());
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto update = [&](int tick, bool rattles, double bias) {
      motion.At(0, 0.5);
      const WrenchObserver::Wrenches truth = motion.wrenches();
      const bool strikes = tick % period < contact;
      std::array<FootReading, 2> reading;
      for (size_t f = 0; f < 2; ++f) {
        reading[f].wrench = truth.segment<6>(static_cast<Eigen::Index>(6 * f));
        if (rattles) reading[f].wrench *= strikes ? static_cast<double>(period) / contact : 0;
        for (int i = 0; i < 6; ++i) reading[f].wrench[i] += (i < 3 ? 1.0 : 0.05) * normal(random);
      }
      reading[1].wrench[2] += bias;
      wrenches.Update(tick, kPeriod, motion.sensors(), reading, {});
    };
    int tick = 0;
    for (; tick < 1000; ++tick) {
      update(tick, tick >= 100, 0);
      ASSERT_TRUE(wrenches.measured(robot::Foot::kRight) && wrenches.measured(robot::Foot::kLeft))
          << period << " " << tick;
    }
    for (; tick < 1500; ++tick) {
      update(tick, false, 0);
      ASSERT_TRUE(wrenches.measured(robot::Foot::kRight) && wrenches.measured(robot::Foot::kLeft))
          << period << " " << tick;
    }
    for (; tick < 1550; ++tick) update(tick, false, 150);
    EXPECT_EQ(wrenches.check(robot::Foot::kLeft).state(), FootSensorCheck::State::kBiased)
        << period;
    // What rattles does not agree: the bias is still there.
    for (; tick < 3000; ++tick) {
      update(tick, true, 150);
      ASSERT_FALSE(wrenches.measured(robot::Foot::kLeft)) << period << " " << tick;
    }
  }
}

// Standing still a reading that stays what it was agrees with everything, but no noise repeats.
TEST(FootSensorCheck, AReadingThatDoesNotChangeIsFrozenThoughItAgrees) {
  Motion motion(TestRobot::kDyros, 0);
  for (const bool free : {false, true}) {
    FootWrenches wrenches(motion.model());
    motion.At(0, free ? 1 : 0.5);
    std::array<FootReading, 2> reading;
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    double noticed = -1;
    for (int tick = 0; tick < 500; ++tick) {
      const WrenchObserver::Wrenches truth = motion.wrenches();
      reading[0].wrench = truth.head<6>() + 0.5 * robot::Vector6d::Constant(normal(random));
      reading[1].wrench = truth.tail<6>();  // zero, exactly, of a free foot
      if (free) reading[1].wrench.setZero();
      wrenches.Update(tick, kPeriod, motion.sensors(), reading, {});
      ASSERT_TRUE(wrenches.measured(robot::Foot::kRight));
      if (noticed < 0 && !wrenches.measured(robot::Foot::kLeft)) noticed = kPeriod * tick;
    }
    if (free) {
      EXPECT_LT(noticed, 0) << "a sensor without noise reads zero in the air";
    } else {
      EXPECT_EQ(wrenches.check(robot::Foot::kLeft).state(), FootSensorCheck::State::kFrozen);
      EXPECT_LE(noticed, 0.15);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FootSensorFault,
    testing::Values(Fault{"Dead", FootSensorCheck::State::kDead,
                          [](const robot::Vector6d&, const robot::Vector6d&) {
                            return robot::Vector6d(robot::Vector6d::Zero());
                          }},
                    Fault{"Frozen", FootSensorCheck::State::kFrozen,
                          [](const robot::Vector6d&, const robot::Vector6d& first) {
                            return robot::Vector6d(first);
                          }},
                    Fault{"Biased", FootSensorCheck::State::kBiased,
                          [](const robot::Vector6d& right, const robot::Vector6d&) {
                            return robot::Vector6d(right + 150 * robot::Vector6d::Unit(2));
                          }}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace poise
