// The landing of one foot against a mass that follows its reference, and a surface that pushes
// back.
#include "components/step_planner/contact/landing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "components/step_planner/planner_config.h"

namespace poise {
namespace {

using State = Landing::State;

/// As phases ship it.
LandingSpec Shipped() { return MakeLandingSpec(ContactConfirmation()); }

constexpr double kTick = 0.002;

TEST(TouchDetector, CountsALoadThatLasts) {
  const LandingSpec config = Shipped();
  TouchDetector touch(config.touch_duration);
  int tick = 0;
  const auto hold = [&](double load, int ticks) {
    bool touching = false;
    for (int i = 0; i < ticks; ++i)
      touching = touch.Update(kTick * tick++, load, LoadLevels(config, 0));
    return touching;
  };
  // 0.02 s are ten periods: eleven readings.
  EXPECT_FALSE(hold(10.1, 10));
  EXPECT_FALSE(hold(9.9, 1));  // once below: the time starts again
  EXPECT_FALSE(hold(500, 10));
  EXPECT_TRUE(hold(10.1, 1));
  EXPECT_TRUE(hold(4.1, 1000));  // between the thresholds it stays
  EXPECT_TRUE(hold(3.9, 10));
  EXPECT_TRUE(hold(4.1, 1));
  EXPECT_TRUE(hold(-1, 10));
  EXPECT_FALSE(hold(-1, 1));
  EXPECT_FALSE(hold(9.9, 1000));
}

TEST(TouchDetector, TimeIsThatOfTheTicks) {
  const LandingSpec config = Shipped();
  TouchDetector touch(0.1);
  EXPECT_FALSE(touch.Update(7.00, 20, LoadLevels(config, 0)));
  EXPECT_FALSE(touch.Update(7.09, 20, LoadLevels(config, 0)));
  EXPECT_TRUE(touch.Update(7.10, 20, LoadLevels(config, 0)));
  TouchDetector at_once(0);
  EXPECT_TRUE(at_once.Update(3, 10.1, LoadLevels(config, 0)));
}

// z of a foot of mass m that the task accelerates with f* against Coulomb friction and a surface of
// spring and damper.
class Foot {
 public:
  static constexpr double kMass = 6, kKp = 225, kKd = 10;      // kg, 1/s², 1/s
  static constexpr double kStiffness = 20000, kDamping = 400;  // N/m, N·s/m
  static constexpr double kStiction = 1e5, kDrag = 300;        // N/m, N·s/m, joints
  static constexpr int kSteps = 40;                            // in a tick

  Foot(double z, double friction) : z_(z), anchor_(z), friction_(friction) {
    reference.position.z() = z;
    scenario_ = reference;
    landing.LiftOff(z);
  }

  /// A minimum-jerk move of the scenario's reference to `to` in `duration` s.
  bool Move(double to, double duration) {
    if (!landing.BeginMove(reference.position.z(), to, time + duration)) return false;
    move_.Begin(reference, {0, 0, to}, time, duration);
    moving_ = true;
    return true;
  }
  /// One tick, the surface at height `surface`, m.
  void Step(double surface, bool before_touch_down, bool due) {
    time += kTick;
    landing.Measure(time, load);
    if (moving_) scenario_ = move_.At(time);
    reference = scenario_;
    Eigen::Isometry3d sole = Eigen::Isometry3d::Identity();
    sole.translation().z() = z_;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    if (landing.Update(before_touch_down, due, sole, &reference, &rotation)) {
      moving_ = false;
      scenario_.position = reference.position;
      scenario_.velocity.setZero();
      scenario_.acceleration.setZero();
    }
    acceleration = reference.acceleration.z() + kKp * (reference.position.z() - z_) +
                   kKd * (reference.velocity.z() - v_);
    const double h = kTick / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double depth = surface - z_;
      const double surface_velocity = (surface - surface_) / kTick;
      load =
          depth > 0 ? std::max(0.0, kStiffness * depth + kDamping * (surface_velocity - v_)) : 0.0;
      // A bristle that slips at `friction_`.
      const double slip = friction_ / kStiction;
      anchor_ = std::clamp(anchor_, z_ - slip, z_ + slip);
      const double friction = kStiction * (anchor_ - z_) - (friction_ > 0 ? kDrag * v_ : 0);
      v_ += h * (acceleration + (load + friction) / kMass);
      z_ += h * v_;
    }
    surface_ = surface;
    lowest = std::min(lowest, z_);
    largest_load = std::max(largest_load, load);
  }
  void Run(double duration, double surface, bool before_touch_down, bool due = false) {
    for (int i = 0; i < std::lround(duration / kTick); ++i) Step(surface, before_touch_down, due);
  }
  double z() const { return z_; }

  Landing landing{Shipped()};
  PointMotion reference;
  double time = 0, load = 0, acceleration = 0, lowest = 1, largest_load = 0;

 private:
  double z_, v_ = 0, anchor_, friction_, surface_ = 0;
  bool moving_ = false;
  QuinticMove move_;
  PointMotion scenario_;
};

// Lifted by 0.12 m, then lowered to 0.085 m in 2 s.
Foot Lowered(double surface, double friction = 8) {
  Foot foot(0, friction);
  foot.Move(0.12, 2);
  foot.Run(3, 0, false);
  EXPECT_EQ(foot.landing.state(), State::kSwing);
  EXPECT_TRUE(foot.Move(0.085, 2));
  foot.Run(2 - kTick, surface, true);
  foot.lowest = foot.z();
  foot.largest_load = 0;
  return foot;
}

class LandingFriction : public testing::TestWithParam<double> {};

TEST_P(LandingFriction, ASurfaceWhereItWasExpectedIsConfirmedWithinASecond) {
  Foot foot = Lowered(0.09, GetParam());
  foot.Run(1, 0.09, true);
  EXPECT_EQ(foot.landing.state(), State::kTouching);
  EXPECT_TRUE(foot.landing.confirmed());
  EXPECT_LT(foot.largest_load, 20 + 5);
  // Let go: contact stays measured, and at the change of the model's contact the task asks for no
  // more than what it presses with.
  for (int i = 0; i < 1000; ++i) {
    foot.Step(0.09, true, false);
    ASSERT_EQ(foot.landing.state(), State::kTouching);
    ASSERT_GT(foot.load, 4);
    ASSERT_LT(foot.load, 13);
    ASSERT_LT(std::abs(Foot::kMass * foot.acceleration), 13);
  }
}

TEST_P(LandingFriction, ALowerSurfaceIsSearchedFor) {
  const double surface = 0.04, friction = GetParam();
  Foot foot = Lowered(surface, friction);
  const double begin = foot.time;
  double last = foot.reference.velocity.z(), step = 0;
  while (foot.landing.state() != State::kTouching && foot.time < begin + 5) {
    foot.Step(surface, true, false);
    EXPECT_FALSE(foot.landing.confirmed());
    if (foot.landing.state() == State::kTouching) break;
    step = std::max(step, std::abs(foot.reference.velocity.z() - last));
    last = foot.reference.velocity.z();
  }
  // The way at kSearchSpeed, then as far again below the surface as a load of 10 N and friction
  // ask for.
  const double press = (10 + friction) / (Foot::kMass * Foot::kKp);
  const double at_least = (0.085 - surface) / 0.03;
  EXPECT_GT(foot.time - begin, at_least);
  EXPECT_LT(foot.time - begin, at_least + 2 * press / 0.03 + 0.3);
  EXPECT_LT(step, 0.03 * kTick / 0.05 + 1e-9);  // no step of velocity
  EXPECT_LT(foot.largest_load, 25);
  const double touched = foot.time;
  while (!foot.landing.confirmed() && foot.time < touched + 1) foot.Step(surface, true, true);
  EXPECT_NEAR(foot.time - touched, 0.3, 1.5 * kTick);
  EXPECT_NEAR(foot.z(), surface, 0.002);
}

TEST_P(LandingFriction, NoSurfaceEndsRetracted) {
  Foot foot = Lowered(-1, GetParam());
  foot.Run(6, -1, true, true);
  EXPECT_EQ(foot.landing.state(), State::kRetracted);
  EXPECT_FALSE(foot.landing.confirmed());
  EXPECT_LE(foot.lowest, 0.085 - 0.06);
  EXPECT_GT(foot.lowest, 0.085 - 0.06 - 0.01);  // the turn is smooth
  // Down and up it stays behind its reference by what friction holds, down also by what drags.
  const double lag = GetParam() / (Foot::kMass * Foot::kKp);
  const double drag = GetParam() > 0 ? Foot::kDrag * 0.03 / (Foot::kMass * Foot::kKp) : 0;
  EXPECT_NEAR(foot.z(), 0.085 - 0.06 + 0.05, 2 * lag + drag + 0.002);
  // For good: neither a load nor a move of the scenario begins it again.
  EXPECT_FALSE(foot.Move(0, 1));
  foot.Run(2, foot.z() + 0.03, true, true);
  EXPECT_GT(foot.load, 10);
  EXPECT_EQ(foot.landing.state(), State::kRetracted);
  EXPECT_FALSE(foot.landing.confirmed());
}

TEST_P(LandingFriction, AFootInTheAirYieldsToASurfaceThatRises) {
  Foot foot(0, GetParam());
  foot.Move(0.12, 2);
  foot.Run(3, 0, false);
  foot.largest_load = 0;
  // 5 cm at 5 cm/s.
  for (int i = 0; i < 500; ++i) foot.Step(0.11 + 0.05 * kTick * i, false, false);
  EXPECT_EQ(foot.landing.state(), State::kTouching);
  // A damper of apparent mass times k_p times the reference's 0.1 s + 0.05 s, friction, and 10 N
  // from which on it yields; twice that for the onset.
  EXPECT_LT(foot.largest_load, 2 * (Foot::kMass * Foot::kKp * 0.15 * 0.05 + GetParam() + 10));
  EXPECT_NEAR(foot.z(), 0.16, 0.003);
  foot.Run(1, 0.16, false);
  EXPECT_FALSE(foot.Move(0.085, 2));  // lowering is over
  foot.Run(2, 0.16, true);
  EXPECT_EQ(foot.landing.state(), State::kTouching);
  EXPECT_TRUE(foot.landing.confirmed());
  EXPECT_LT(foot.load, 20);
}

INSTANTIATE_TEST_SUITE_P(All, LandingFriction, testing::Values(0.0, 8.0));  // N

TEST(Landing, ASurfaceThatGoesAwayIsSearchedForAgain) {
  Foot foot = Lowered(0.09);
  foot.Run(1, 0.09, true);
  ASSERT_TRUE(foot.landing.confirmed());
  foot.Run(0.1, 0.06, true);
  EXPECT_EQ(foot.landing.state(), State::kSearching);
  EXPECT_FALSE(foot.landing.confirmed());
  foot.Run(3, 0.06, true);
  EXPECT_TRUE(foot.landing.confirmed());
  EXPECT_NEAR(foot.z(), 0.06, 0.002);
}

TEST(Landing, BeforeAnotherSingleSupportPhaseItRestsWhereTheSurfaceLeftIt) {
  Foot foot(0, 8);
  foot.Move(0.12, 2);
  foot.Run(3, 0, false);
  for (int i = 0; i < 500; ++i) foot.Step(0.105 + 0.02 * kTick * i, false, false);
  ASSERT_EQ(foot.landing.state(), State::kTouching);
  const double z = foot.z();
  foot.Run(3, 0, false);
  EXPECT_EQ(foot.landing.state(), State::kSwing);
  EXPECT_NEAR(foot.z(), z, 0.012);
}

TEST(Landing, OnlyALoweredFootSearchesByItself) {
  Foot foot(0, 8);
  foot.Move(0.12, 2);
  foot.Run(5, 0, true);
  EXPECT_EQ(foot.landing.state(), State::kSwing);
  foot.Step(0, true, true);  // double support is due: now it must come down
  EXPECT_EQ(foot.landing.state(), State::kSearching);

  Foot lowered(0, 8);
  lowered.Move(0.12, 2);
  lowered.Run(3, 0, false);
  lowered.Move(0.085, 2);
  lowered.Run(5, 0, false);  // never comes down
  EXPECT_EQ(lowered.landing.state(), State::kSwing);
}

TEST(Landing, AFootThatHasNotLeftTheGroundStands) {
  const LandingSpec config = Shipped();
  Landing landing(config);
  landing.LiftOff(0);
  PointMotion reference;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int tick = 0; tick < 100; ++tick) {
    landing.Measure(kTick * tick, 5);  // between the thresholds
    EXPECT_FALSE(landing.Update(true, true, Eigen::Isometry3d::Identity(), &reference, &rotation));
    EXPECT_TRUE(landing.confirmed());
  }
  for (int tick = 100; tick < 120; ++tick) {
    landing.Measure(kTick * tick, 0);
    landing.Update(true, true, Eigen::Isometry3d::Identity(), &reference, &rotation);
  }
  EXPECT_FALSE(landing.confirmed());
  EXPECT_EQ(landing.state(), State::kSearching);
}

TEST(Landing, AMoveUpwardTakesATouchingFootOff) {
  Foot foot = Lowered(0.09);
  foot.Run(1, 0.09, true);
  ASSERT_EQ(foot.landing.state(), State::kTouching);
  EXPECT_TRUE(foot.Move(0.15, 1));
  foot.Run(2, 0.09, false);
  EXPECT_EQ(foot.landing.state(), State::kSwing);
  EXPECT_NEAR(foot.z(), 0.15, 0.012);
}

TEST(Landing, ATapOnTheWayUpDoesNotEndTheMove) {
  Foot foot(0, 8);
  foot.Move(0.12, 2);
  foot.Run(0.5, 0, false);
  foot.Run(0.1, foot.z() + 0.005, false);  // something in the way, then gone
  foot.Run(3, 0, false);
  EXPECT_EQ(foot.landing.state(), State::kSwing);
  EXPECT_NEAR(foot.z(), 0.12, 0.012);
}

// The sole takes the surface's slope and place: what it touches with is let go in all axes.
TEST(Landing, ATouchingFootsReferenceComesToItsSole) {
  const LandingSpec config = Shipped();
  Landing landing(config);
  landing.LiftOff(0);
  Eigen::Isometry3d sole = Eigen::Isometry3d::Identity();
  sole.translation() = Eigen::Vector3d(0.01, -0.02, 0.09);
  sole.linear() = Eigen::AngleAxisd(0.08, Eigen::Vector3d::UnitX()).toRotationMatrix();
  PointMotion reference;
  Eigen::Matrix3d rotation;
  for (int tick = 0; tick < 1000; ++tick) {
    landing.Measure(kTick * tick, tick < 100 ? 0 : 11);
    if (tick < 200) {
      reference = {};
      reference.position.z() = 0.08;
      rotation.setIdentity();
    }
    landing.Update(true, false, sole, &reference, &rotation);
  }
  EXPECT_EQ(landing.state(), State::kTouching);
  EXPECT_LT((reference.position - sole.translation()).norm(), 1e-4);
  EXPECT_LT(reference.velocity.norm(), 1e-3);
  EXPECT_LT((rotation - sole.linear()).norm(), 1e-4);
}

// A foot of a walk, which meets a step on its way up and the ground as it comes down.
TEST(Landing, ASwingLeavesBehindWhatItMeetsOnItsWayUp) {
  LandingSpec spec = Shipped();
  spec.settle = spec.touch_duration = 0;
  Landing landing(spec);
  PointMotion reference;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  landing.BeginSwing(0, 0.2);
  for (int tick = 0; tick < 200; ++tick) {
    const double time = kTick * tick;
    landing.Measure(time, time < 0.1 || time > 0.3 ? 100 : 0);
    landing.Update(true, false, Eigen::Isometry3d::Identity(), &reference, &rotation);
    EXPECT_EQ(landing.confirmed(), time > 0.3) << time;
  }
}

// A foot of a walk whose leg cannot press: neither the press nor the search goes on for ever.
TEST(Landing, APressGoesNoDeeperThanASearch) {
  LandingSpec spec = Shipped();
  spec.presses = true;
  spec.retracts = false;
  Landing landing(spec);
  PointMotion reference;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  landing.BeginSwing(0, 0);
  const auto run = [&](double load, int from, int to) {
    for (int tick = from; tick < to; ++tick) {
      landing.Measure(kTick * tick, load);
      reference = {};
      landing.Update(true, true, Eigen::Isometry3d::Identity(), &reference, &rotation);
    }
  };
  run(11, 0, 10000);  // above touch, below 0.8 of the press
  EXPECT_EQ(landing.state(), State::kTouching);
  EXPECT_FALSE(landing.confirmed());
  EXPECT_NEAR(reference.position.z(), -spec.search_depth, 1e-9);
  run(0, 10000, 20000);
  EXPECT_FALSE(landing.confirmed());
  EXPECT_NEAR(reference.position.z(), -spec.search_depth, 1e-9);
  run(25, 20000, 20500);
  EXPECT_TRUE(landing.confirmed());
}

// An observed load is a touch only above three of its standard deviations.
TEST(Landing, AnObservedLoadMustBeMoreThanItsNoise) {
  for (const double deviation : {0.0, 20.0}) {
    Landing landing(Shipped());
    PointMotion reference;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    landing.BeginSwing(0, 0);
    for (int tick = 0; tick < 100; ++tick) {
      landing.Measure(kTick * tick, 50, deviation);
      landing.Update(true, false, Eigen::Isometry3d::Identity(), &reference, &rotation);
    }
    EXPECT_EQ(landing.state(), deviation > 0 ? State::kSwing : State::kTouching);
  }
}

// A foot that stands on the ground and was never told to have landed carries what its task presses
// with: a tenth of the weight. It waited for 0.15 of it while the robot fell.
TEST(Landing, AThirdOfAnObservedLoadIsContactOfAFootThatSearches) {
  LandingSpec spec = Shipped();
  spec.observed_load = 60;  // N
  for (const bool past_its_time : {false, true}) {
    for (const double load : {15.0, 25.0, 65.0}) {
      Landing landing(spec);
      PointMotion reference;
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
      landing.BeginSwing(0, 0);
      for (int tick = 0; tick < 100; ++tick) {
        landing.Measure(kTick * tick, tick < 10 ? 0 : load, 2);
        landing.Update(true, past_its_time, Eigen::Isometry3d::Identity(), &reference, &rotation);
      }
      EXPECT_EQ(landing.state() == State::kTouching, load > (past_its_time ? 20 : 60)) << load;
    }
  }
}

}  // namespace
}  // namespace poise
