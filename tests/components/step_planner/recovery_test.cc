// Recovery steps of the point mass.
#include "components/step_planner/stepping/recovery.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "components/robot/posture.h"
#include "components/step_planner/recovery_config.h"
#include "components/step_planner/stepping/pendulum.h"
#include "components/step_planner/stepping/point_mass.h"
#include "tests/robot/robot_test_support.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

constexpr double kPeriod = 0.002;  // s

/// The shipped numbers of the robot's recovery.
RecoverySpec Shipped(TestRobot robot) {
  return MakeRecoverySpec(RecoveryConfig(), ContactConfirmation(), robot::LoadTestRobot(robot), -1);
}

constexpr double kLingers = 0.1;  // s near the edge that make a step

RecoverySpec Lingering(TestRobot robot, double inside) {
  RecoverySpec spec = Shipped(robot);
  spec.margin_to_sole_edge = inside;
  return spec;
}

/// The point mass with its steps, and what is checked of each tick of them.
class World : public PointMass {
 public:
  explicit World(TestRobot robot, double ground_there = 0)
      : World(robot, ground_there, Shipped(robot)) {}
  /// `choice`: nullptr: the shipped one.
  World(TestRobot robot, double ground_there, const RecoverySpec& spec,
        const StepChoice* choice = nullptr)
      : World(robot::LoadTestRobot(robot), ground_there, spec, choice) {}

  void Walk(const Vector2d& velocity) { Command({velocity, 0, true}); }
  void Stop() { Command({}); }

  void Tick() {
    const Stage before = recovery().stage();
    if (PointMass::Tick(kPeriod)) Check(before, recovery().output());
  }
  /// False: the robot fell.
  bool Run(double duration) {
    for (const double end = time() + duration; time() < end;) {
      Tick();
      if (fallen()) return false;
    }
    return true;
  }
  bool Rests() const {
    return !recovery().active() && balance::SignedDistance(Soles(0), capture_point()) > 0 &&
           velocity().norm() < 0.1;
  }

  /// m, least so far while a foot swings, between rectangles of the soles in line with the axes.
  double nearest() const { return nearest_; }
  const robot::RobotModel& model() const { return model_; }
  double largest_jump() const { return largest_jump_; }
  /// The load's fastest ramp, in a tick.
  double fastest_ramp() const { return fastest_ramp_; }
  double touched() const { return touched_; }
  double decided() const { return decided_; }

 private:
  World(robot::RobotModel model, double ground_there, const RecoverySpec& spec,
        const StepChoice* choice)
      : PointMass(model, Recovery(choice == nullptr ? MakeStepChoice(model) : *choice, spec)),
        model_(std::move(model)) {
    set_ground(ground_there);
  }
  void Check(Stage before, const StepOutput& output) {
    const Stage now = recovery().stage();
    EXPECT_TRUE(output.in_contact[0] || output.in_contact[1]);
    EXPECT_EQ(output.in_contact[0] && output.in_contact[1], now != Stage::kSwinging);
    EXPECT_GE(output.progress, 0);
    EXPECT_LE(output.progress, 1);
    if (now == Stage::kSwinging) {
      const Vector3d apart =
          (sole(Foot::kLeft).translation() - sole(Foot::kRight).translation()).cwiseAbs();
      const robot::FootModel& foot = model_.feet()[0];
      nearest_ = std::min(nearest_, std::max(apart.x() - foot.length, apart.y() - foot.width));
      // On the stance sole.
      const Foot stance = Other(output.foot);
      EXPECT_TRUE(output.in_contact[stance]);
      EXPECT_GE(balance::SignedDistance(
                    SoleAt(model_.feet()[stance], 0, sole(stance).translation().head<2>(), 0),
                    output.cop),
                0);
    }
    // The centre of pressure asked for goes, it does not jump; but for a foot that swings at once.
    if (before != Stage::kStanding) {
      largest_jump_ = std::max(largest_jump_, (output.cop - last_cop_).norm());
    } else {
      decided_ = time();
    }
    // As it lands the other foot may leave.
    const int steps = recovery().num_begun();
    const bool lands = now == Stage::kLoading || steps > last_steps_;
    if (before == Stage::kSwinging && lands && touched_ < 0) touched_ = time();
    last_steps_ = steps;
    last_cop_ = output.cop;
    if (output.transition != TransitionKind::kNone && output.transition == last_transition_) {
      fastest_ramp_ = std::max(fastest_ramp_, output.progress - last_progress_);
    }
    last_transition_ = output.transition;
    last_progress_ = output.progress;
  }

  robot::RobotModel model_;
  Vector2d last_cop_ = Vector2d::Zero();
  double nearest_ = 1, largest_jump_ = 0, touched_ = -1, decided_ = -1;
  int last_steps_ = 0;
  TransitionKind last_transition_ = TransitionKind::kNone;
  double last_progress_ = 0, fastest_ramp_ = 0;
};

Vector2d Direction(double degrees) {
  return {std::cos(degrees * M_PI / 180), std::sin(degrees * M_PI / 180)};
}

// m from the middle to the edge of both soles, less the reserve, along a direction: by bisection.
double EdgeDistance(const World& world, const Vector2d& direction, double edge) {
  const double spacing = robot::StandingSpacing(world.model());
  const balance::ConvexPolygon soles =
      HullOf(SoleAt(world.model().feet()[0], edge, {0, -0.5 * spacing}, 0),
             SoleAt(world.model().feet()[1], edge, {0, 0.5 * spacing}, 0));
  double low = 0, high = 2;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (balance::SignedDistance(soles, middle * direction) > 0 ? low : high) = middle;
  }
  return low;
}

class RecoveryCase : public testing::TestWithParam<TestRobot> {};

// Somewhat beyond what the centre of pressure reaches, 10 mm inside the edge, it goes out.
TEST_P(RecoveryCase, WhatLingersAtTheEdgeAndComesOutGetsAStepSooner) {
  constexpr double kNear = 0.006;
  for (const double degrees : {0.0, 180.0}) {
    const Vector2d direction = Direction(degrees);
    std::array<double, 2> decided{};
    for (const bool lingers : {false, true}) {
      World world(GetParam(), 0, lingers ? Lingering(GetParam(), kNear) : Shipped(GetParam()));
      const double edge = EdgeDistance(world, direction, 0);
      world.Push(world.mass() * world.frequency() *
                 (EdgeDistance(world, direction, 0.01) + 0.0005) * direction);
      while (world.capture_point().dot(direction) < edge - kNear) world.Tick();
      const double near = world.time();
      EXPECT_TRUE(world.Run(4)) << degrees;
      EXPECT_TRUE(world.Rests()) << degrees;
      EXPECT_EQ(world.recovery().num_begun(), 1) << degrees;
      decided[lingers ? 1 : 0] = world.decided();
      if (!lingers) continue;
      EXPECT_EQ(world.recovery().reason(), StepReason::kLingering) << degrees;
      EXPECT_NEAR(world.decided(), near + kLingers, 1.5 * kPeriod) << degrees;
    }
    EXPECT_LT(decided[1], decided[0]) << degrees;
  }
}

// On the right foot, the capture point 4 mm inside its edge: the free foot can catch it on its own
// side; on the other one it would have to cross.
TEST_P(RecoveryCase, WhereNoStepHelpsAnotherStrategyHasTheCentreOfPressure) {
  for (const double watch : {-1.0, 0.01}) {
    for (const double side : {1.0, -1.0}) {
      RecoverySpec spec = Shipped(GetParam());
      spec.watched_margin = watch;
      World world(GetParam(), 0, spec);
      world.LiftLeft(0.05);
      const double out = 0.5 * world.model().feet()[0].width - 0.004;
      world.Push({0, side * world.mass() * world.frequency() * out});
      world.Tick();
      EXPECT_FALSE(world.recovery().active());
      EXPECT_EQ(world.recovery().would_step(), watch < 0 || side > 0) << watch << ' ' << side;
    }
  }
}

// A push far beyond what steps catch: no foot is sent where no leg reaches, and none for long.
TEST_P(RecoveryCase, NoFootIsSentFartherThanLegsReachHoweverHardThePush) {
  int steps = 0;
  for (int i = 0; i < 16; ++i) {
    for (const double share : {1.05, 1.2, 1.5, 2.5}) {
      World world(GetParam());
      const double size = EdgeDistance(world, Direction(22.5 * i), 0.01);
      world.Push(share * world.mass() * world.frequency() * size * Direction(22.5 * i));
      // Two legs, and the sole that rolls over its edge.
      const double farthest = 2 * world.height() + world.model().feet()[0].length;
      for (int tick = 0; tick < 1000; ++tick) {
        world.Tick();
        const Recovery& recovery = world.recovery();
        if (recovery.stage() != Stage::kUnloading && recovery.stage() != Stage::kSwinging) continue;
        const Footstep& step = recovery.steps().first();
        const Vector2d stance = world.sole(Other(step.foot)).translation().head<2>();
        ASSERT_TRUE(step.at.position.allFinite()) << i << ' ' << share;
        ASSERT_LT((step.at.position - stance).norm(), farthest) << i << ' ' << share;
        ASSERT_LT(step.touch_down - world.time(), 4 / world.frequency()) << i << ' ' << share;
      }
      steps += world.recovery().num_begun();
    }
  }
  EXPECT_GT(steps, 10);
}

TEST_P(RecoveryCase, WhatTheSolesCanStopGetsNoStep) {
  for (double degrees = 0; degrees < 360; degrees += 30) {
    World world(GetParam(), 0, degrees < 180 ? Shipped(GetParam()) : Lingering(GetParam(), 0.006));
    const Vector2d direction = Direction(degrees);
    world.Push(0.97 * world.mass() * world.frequency() * EdgeDistance(world, direction, 0.01) *
               direction);
    EXPECT_TRUE(world.Run(4)) << degrees;
    EXPECT_EQ(world.recovery().num_begun(), 0) << degrees;
  }
}

// Ahead and behind a step catches nearly what the closed form allows with the time that the step
// took and as far as the legs reach, and no more.
TEST_P(RecoveryCase, OneStepCatchesWhatTheClosedFormSays) {
  for (const double degrees : {0.0, 180.0}) {
    const Vector2d direction = Direction(degrees);
    double largest = 0, time = 0;
    const World still(GetParam());
    const double scale = still.mass() * still.frequency();
    for (double impulse = 0.1 * scale; impulse < 0.6 * scale; impulse += 0.01 * scale) {
      World world(GetParam());
      world.Push(impulse * direction);
      if (!world.Run(6) || world.recovery().num_begun() > 1) break;
      EXPECT_TRUE(world.Rests()) << impulse;
      if (world.recovery().num_begun() == 1) time = world.touched();
      largest = impulse;
    }
    ASSERT_GT(time, 0);
    const double rest = EdgeDistance(still, direction, 0);
    EXPECT_GT(largest, 1.05 * scale * rest) << "no more than without a step";
    // No leg reaches farther from an edge to the next one than it is long.
    EXPECT_LT(largest,
              LargestImpulse(still.mass(), still.frequency(), rest, still.height(), time, 1));
  }
}

TEST_P(RecoveryCase, AHarderPushTakesMoreSteps) {
  int last = 0;
  const World still(GetParam());
  const double rest = EdgeDistance(still, {1, 0}, 0);
  for (const double share : {0.9, 1.15, 1.6}) {
    World world(GetParam());
    world.Push({share * still.mass() * still.frequency() * rest, 0});
    if (!world.Run(6)) break;
    EXPECT_GE(world.recovery().num_begun(), last) << share;
    EXPECT_TRUE(world.Rests()) << share;
    last = world.recovery().num_begun();
  }
  EXPECT_GE(last, 1);
}

TEST_P(RecoveryCase, TheFootInTheAirStepsAtOnce) {
  World world(GetParam());
  world.LiftLeft(0.05);
  // To the left, where the free foot is.
  world.Push({0, 1.5 * world.mass() * world.frequency() * 0.5 * world.model().feet()[0].width});
  EXPECT_TRUE(world.Run(5));
  EXPECT_GE(world.recovery().num_begun(), 1);
  EXPECT_EQ(world.recovery().output().in_contact, (std::array{true, true}));
  EXPECT_TRUE(world.Rests());
}

// Ahead and behind: more than standing by a step around the standing leg, no more than the closed
// form allows, and no sole upon the other.
TEST_P(RecoveryCase, TheFootInTheAirGoesAroundTheOther) {
  const World still(GetParam());
  const double scale = still.mass() * still.frequency();
  const robot::FootModel& foot = still.model().feet()[0];
  struct Way {
    Vector2d direction;
    double rest, gain;
  };
  for (const Way& way :
       {Way{{1, 0}, 0.5 * foot.length, 1.15}, Way{{-1, 0}, 0.5 * foot.length, 1.15}}) {
    double largest = 0, time = 0;
    for (double impulse = 0.8 * way.rest * scale; impulse < scale; impulse += 0.01 * scale) {
      World world(GetParam());
      world.LiftLeft(0.05);
      world.Push(impulse * way.direction);
      const bool stands = world.Run(6);
      EXPECT_GT(world.nearest(), 0.01) << way.direction.transpose() << ' ' << impulse;
      if (!stands || world.recovery().num_begun() > 1) break;
      EXPECT_TRUE(world.Rests()) << impulse;
      if (world.recovery().num_begun() == 1) time = world.touched();
      largest = impulse;
    }
    ASSERT_GT(time, 0) << way.direction.transpose();
    EXPECT_GT(largest, way.gain * scale * way.rest) << way.direction.transpose();
    EXPECT_LT(largest,
              LargestImpulse(still.mass(), still.frequency(), way.rest, still.height(), time, 1));
  }
}

// After a step ahead, and after one in line with the standing foot.
TEST_P(RecoveryCase, TheFeetComeSideBySideWhenAsked) {
  for (const bool one_foot : {false, true}) {
    World world(GetParam());
    if (one_foot) world.LiftLeft(0.05);
    const double rest =
        one_foot ? 0.5 * world.model().feet()[0].length : EdgeDistance(world, {1, 0}, 0);
    world.Push({1.1 * world.mass() * world.frequency() * rest, 0});
    ASSERT_TRUE(world.Run(5));
    ASSERT_TRUE(world.Rests());
    const int steps = world.recovery().num_begun();
    ASSERT_GE(steps, 1);
    EXPECT_GT((world.sole(Foot::kLeft).translation() - world.sole(Foot::kRight).translation())
                  .cwiseAbs()
                  .x(),
              0.05);
    world.recovery().BringTogether();
    ASSERT_TRUE(world.Run(8));
    EXPECT_TRUE(world.Rests());
    EXPECT_EQ(world.recovery().num_begun(), steps + 1);
    const Vector3d apart =
        world.sole(Foot::kLeft).translation() - world.sole(Foot::kRight).translation();
    EXPECT_NEAR(apart.x(), 0, 0.005);
    EXPECT_NEAR(apart.y(), robot::StandingSpacing(world.model()), 0.005);
    EXPECT_GT(world.nearest(), 0.01);
    // Where they are, nothing is to be done.
    world.recovery().BringTogether();
    world.Run(3);
    EXPECT_EQ(world.recovery().num_begun(), steps + 1);
  }
}

// Pushed while a foot is unloaded so that it comes beside the other one: its load goes on from
// where it is, no faster than before a step that catches a push, and the foot comes down as soon as
// such a one.
TEST_P(RecoveryCase, APushWhileTheFeetComeTogetherJumpsNoLoad) {
  // Shorter steps than those of a COM that goes down as far as it ships: with feet farther apart
  // than they leave them hardly a push is caught on the way, by whatever foot.
  const robot::RobotModel model = robot::LoadTestRobot(GetParam());
  const StepChoice lower(model, Reach(model, robot::StandingHeight(model), 0.03, 0.02),
                         MakeStepChoice(model).limits());
  int hurried = 0, stood = 0;
  for (const double unloaded : {0.1, 0.5, 0.9}) {
    for (double degrees = 0; degrees < 360; degrees += 15) {
      World world(GetParam(), 0, Shipped(GetParam()), &lower);
      const double rest = EdgeDistance(world, {1, 0}, 0);
      const double impulse = world.mass() * world.frequency() * rest;
      world.Push({1.1 * impulse, 0});
      ASSERT_TRUE(world.Run(5) && world.Rests());
      world.recovery().BringTogether();
      const auto unloads = [&] { return world.recovery().stage() == Stage::kUnloading; };
      const auto progress = [&] { return world.recovery().output().progress; };
      for (int i = 0; i < 5000 && !(unloads() && progress() >= unloaded); ++i) world.Tick();
      ASSERT_TRUE(unloads());
      ASSERT_EQ(world.recovery().reason(), StepReason::kTogether);
      const double pushed = world.time();
      world.Push(1.2 * impulse * Direction(degrees));
      world.Tick();
      if (!unloads() || world.recovery().reason() == StepReason::kTogether) continue;
      ++hurried;
      const auto lands = [&, step = world.recovery().num_begun()] {
        return world.recovery().stage() == Stage::kLoading || world.recovery().num_begun() > step;
      };
      for (int i = 0; i < 2000 && !lands(); ++i) world.Tick();
      // Unloaded within 0.02 s, then 0.12 s in the air, or as long as the way takes.
      EXPECT_LT(world.time() - pushed, 0.7) << unloaded << ' ' << degrees;
      const double fastest = kPeriod / world.recovery().choice().limits().unload;
      EXPECT_LT(world.fastest_ramp(), 1.001 * fastest) << unloaded << ' ' << degrees;
      stood += world.Run(6) && world.Rests() ? 1 : 0;
    }
  }
  EXPECT_GE(hurried, 30);
  EXPECT_GE(stood, 5);  // none, with a foot that took its time
}

// The ground is 3 cm higher or 4 cm lower than the stance sole: the load says where it is.
TEST_P(RecoveryCase, WalksWhereItIsTold) {
  const World shape(GetParam());
  const double speed = std::sqrt(robot::kGravity * shape.height());
  for (const Vector2d& share : {Vector2d(0, 0), Vector2d(0.2, 0), Vector2d(-0.1, 0),
                                Vector2d(0, 0.05), Vector2d(0.1, -0.03)}) {
    World world(GetParam());
    world.Walk(speed * share);
    ASSERT_TRUE(world.Run(5)) << share.transpose();
    const Vector2d from = world.com().head<2>();
    const double since = world.time();
    const int steps = world.recovery().num_begun();
    ASSERT_TRUE(world.Run(5)) << share.transpose();
    const Vector2d velocity = (world.com().head<2>() - from) / (world.time() - since);
    EXPECT_LT((velocity - speed * share).norm(), 0.15 * speed * share.norm() + 0.02)
        << velocity.transpose() << " of " << (speed * share).transpose();
    // ωT = 1.3 a step, and no more than loading and unloading later: here both soles carry alike,
    // so that no foot leaves before its ramp ends.
    const double stride = shape.frequency() * 5 / (world.recovery().num_begun() - steps);
    EXPECT_GT(stride, 1.2);
    EXPECT_LT(stride, 1.3 + shape.frequency() * 0.1);
    world.Stop();
    ASSERT_TRUE(world.Run(10)) << share.transpose();
    EXPECT_TRUE(world.Rests()) << share.transpose();
    const Vector3d apart =
        world.sole(Foot::kLeft).translation() - world.sole(Foot::kRight).translation();
    EXPECT_NEAR(apart.x(), 0, 0.04) << share.transpose();
    EXPECT_NEAR(apart.y(), robot::StandingSpacing(world.model()), 0.04) << share.transpose();
  }
}

TEST_P(RecoveryCase, CatchesAPushAsItWalks) {
  const World shape(GetParam());
  const double speed = std::sqrt(robot::kGravity * shape.height());
  for (int direction = 0; direction < 8; ++direction) {
    for (const double moment : {4.0, 4.1, 4.2, 4.3}) {
      World world(GetParam());
      world.Walk({0.15 * speed, 0});
      ASSERT_TRUE(world.Run(moment));
      world.Push(0.08 * world.mass() * speed * Direction(45 * direction));
      EXPECT_TRUE(world.Run(5)) << direction << ' ' << moment;
      const double before = world.com().x();
      EXPECT_TRUE(world.Run(2)) << direction << ' ' << moment;
      EXPECT_NEAR((world.com().x() - before) / 2, 0.15 * speed, 0.05 * speed);
    }
  }
}

// Pushed out over the stance foot, the robot has no use for the foot in the air where and when the
// walk wants it: by the pendulum the capture point is out of the stride's reach by then.
TEST_P(RecoveryCase, AStrideInTheAirThatMissesBecomesAStepThatCatches) {
  for (const Foot stance : kFeet) {
    World world(GetParam());
    world.Walk({0, 0});
    ASSERT_TRUE(world.Run(4));
    const auto begins = [&] {
      return world.recovery().stage() == Stage::kSwinging &&
             Other(world.recovery().output().foot) == stance;
    };
    while (begins()) ASSERT_TRUE(world.Run(kPeriod));
    while (!begins()) ASSERT_TRUE(world.Run(kPeriod));
    ASSERT_TRUE(world.Run(0.1));
    ASSERT_EQ(world.recovery().reason(), StepReason::kWalk);
    const double planned = world.recovery().status().step.touch_down;
    const double speed = std::sqrt(robot::kGravity * world.height());
    world.Push({0, -0.25 * Side(Other(stance)) * world.mass() * speed});
    ASSERT_TRUE(world.Run(2 * kPeriod));
    EXPECT_EQ(world.recovery().reason(), StepReason::kAgain);
    EXPECT_NE(world.recovery().status().step.touch_down, planned);
    EXPECT_TRUE(world.Run(5)) << Index(stance);
  }
}

TEST_P(RecoveryCase, LandsWhereTheGroundIs) {
  const World still(GetParam());
  const double push = 1.15 * still.mass() * still.frequency() * EdgeDistance(still, {1, 0}, 0);
  std::vector<double> touched;
  for (const double ground : {0.03, 0.0, -0.04}) {
    World world(GetParam(), ground);
    world.Push({push, 0});
    // Standing, the soles are on the level.
    world.Run(5);
    ASSERT_GT(world.touched(), 0) << ground;
    touched.push_back(world.touched());
  }
  EXPECT_LT(touched[0], touched[1]);
  // At the speed with which it comes down, 0.25 m/s.
  EXPECT_NEAR(touched[2] - touched[1], 0.04 / 0.25, 0.01);
}

TEST_P(RecoveryCase, TheCentreOfPressureDoesNotJump) {
  World world(GetParam());
  world.Push({1.2 * world.mass() * world.frequency() * EdgeDistance(world, {1, 0}, 0), 0});
  EXPECT_TRUE(world.Run(4));
  EXPECT_GE(world.recovery().num_begun(), 1);
  // 0.4 m in the steepest part of the shortest ramp.
  EXPECT_LT(world.largest_jump(), 1.875 * 0.4 * kPeriod / Recovery::kLoadTime);
}

// Whoever takes over in mid-step goes on with the same bits.
TEST_P(RecoveryCase, TheArchiveIsAllOfItsState) {
  for (int at = 5; at < 600; at += 45) {
    World one(GetParam()), other(GetParam());
    for (World* world : {&one, &other}) {
      world->Push({1.2 * world->mass() * world->frequency() * EdgeDistance(*world, {1, 0}, 0), 1});
      for (int tick = 0; tick < at; ++tick) world->Tick();
    }
    StateArchive measure;
    one.recovery().Archive(&measure);
    std::vector<uint8_t> bytes(measure.size());
    StateArchive save = StateArchive::Saving(bytes);
    one.recovery().Archive(&save);
    ASSERT_TRUE(save.ok());
    World still(GetParam());
    other.recovery() = still.recovery();
    StateArchive restore = StateArchive::Restoring(bytes);
    other.recovery().Archive(&restore);
    ASSERT_TRUE(restore.ok());
    for (int tick = 0; tick < 300; ++tick) {
      one.Tick();
      other.Tick();
      ASSERT_EQ(one.recovery().stage(), other.recovery().stage()) << at << ' ' << tick;
      ASSERT_EQ(one.recovery().output().com.acceleration,
                other.recovery().output().com.acceleration)
          << at << ' ' << tick;
      ASSERT_EQ(one.recovery().output().swing.position, other.recovery().output().swing.position)
          << at << ' ' << tick;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, RecoveryCase, testing::Values(TestRobot::kDyros));

}  // namespace
}  // namespace poise::stepping
