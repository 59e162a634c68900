// What steps are made of: the pendulum against integration, the legs' reach against the posture
// solver, the swing's continuity, the choice of a step against a search over all footholds.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "components/robot/posture.h"
#include "components/step_planner/legs/reach.h"
#include "components/step_planner/legs/swing.h"
#include "components/step_planner/stepping/pendulum.h"
#include "components/step_planner/stepping/step_choice.h"
#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

constexpr double kGravity = 9.80665;

// c̈ = ω² (c − p), fourth order.
void Integrate(const Vector2d& cop, double frequency, double time, Vector2d* com,
               Vector2d* velocity) {
  constexpr int kSteps = 2000;
  const double dt = time / kSteps, square = frequency * frequency;
  const auto slope = [&](const Vector2d& c) -> Vector2d { return square * (c - cop); };
  for (int i = 0; i < kSteps; ++i) {
    const Vector2d c = *com, v = *velocity;
    const Vector2d a1 = slope(c), v2 = v + 0.5 * dt * a1;
    const Vector2d a2 = slope(c + 0.5 * dt * v), v3 = v + 0.5 * dt * a2;
    const Vector2d a3 = slope(c + 0.5 * dt * v2), v4 = v + dt * a3;
    const Vector2d a4 = slope(c + dt * v3);
    *com = c + dt / 6 * (v + 2 * v2 + 2 * v3 + v4);
    *velocity = v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
}

TEST(Pendulum, IsWhatIntegrationGives) {
  std::mt19937 random{TestSeed(160)};
  std::uniform_real_distribution<double> any(-0.5, 0.5);
  for (int trial = 0; trial < 50; ++trial) {
    const Pendulum start{{any(random), any(random)}, {any(random), any(random)}, 3 + any(random)};
    const Vector2d cop(any(random), any(random));
    const double time = 0.6 + any(random);
    Vector2d com = start.com, velocity = start.velocity;
    Integrate(cop, start.frequency, time, &com, &velocity);
    const Pendulum end = After(start, cop, time);
    EXPECT_LT((end.com - com).norm(), 1e-9);
    EXPECT_LT((end.velocity - velocity).norm(), 1e-9);
    EXPECT_LT(
        (CapturePointAfter(start.capture_point(), cop, start.frequency, time) - end.capture_point())
            .norm(),
        1e-9);
  }
}

// The largest impulse, step by step: each time the next foot comes down as far as it reaches, the
// centre of pressure goes to its far edge, and the last one stands exactly at the capture point.
TEST(Pendulum, TheLargestImpulseIsJustCaught) {
  const double mass = 50, height = 0.8, rest = 0.12, reach = 0.4, time = 0.35;
  const double frequency = std::sqrt(kGravity / height);
  for (int steps = 0; steps <= 4; ++steps) {
    const double impulse = LargestImpulse(mass, frequency, rest, reach, time, steps);
    for (const double share : {0.999, 1.001}) {
      Vector2d com = Vector2d::Zero(), velocity(share * impulse / mass, 0);
      double edge = rest;
      for (int i = 0; i < steps; ++i) {
        Integrate({edge, 0}, frequency, time, &com, &velocity);
        edge += reach;
      }
      // Caught when the capture point is not beyond the last edge.
      EXPECT_EQ(com.x() + velocity.x() / frequency < edge, share < 1) << steps;
    }
  }
}

TEST(Swing, IsSmoothWhereverTheFootholdGoes) {
  std::mt19937 random{TestSeed(161)};
  std::uniform_real_distribution<double> any(-1, 1);
  const SwingSpec spec{.clearance = 0.05, .touch_speed = 0.25, .freeze = 0.05};
  for (int trial = 0; trial < 30; ++trial) {
    Swing swing;
    const Vector3d start(any(random), any(random), 0.02 * any(random));
    PointMotion from{.position = start};
    from.velocity = 0.3 * Vector3d(any(random), any(random), any(random));
    swing.Begin(from, Eigen::Matrix3d::Identity(), start + Vector3d(0.3, 0.1, 0.01),
                Eigen::AngleAxisd(0.2, Vector3d::UnitZ()).toRotationMatrix(), 0, 0.4, spec);
    const double dt = 1e-4;
    PointMotion last = swing.At(0);
    EXPECT_LT((last.position - start).norm() + (last.velocity - from.velocity).norm(), 1e-12);
    double highest = -1;
    for (int i = 1; i * dt < 0.45; ++i) {
      const double time = i * dt;
      if (i % 50 == 0) {
        swing.Move(
            (start + Vector3d(0.3, 0.1, 0)).head<2>() + 0.05 * Vector2d(any(random), any(random)),
            time, 0.4 + 0.02 * any(random));
      }
      const PointMotion now = swing.At(time);
      // The derivatives are those of the position, and none jumps: bounded by the next one's size.
      EXPECT_LT((now.position - last.position - 0.5 * dt * (now.velocity + last.velocity)).norm(),
                1e-8);
      EXPECT_LT(
          (now.velocity - last.velocity - 0.5 * dt * (now.acceleration + last.acceleration)).norm(),
          1e-4);  // an acceleration that jumps by 2 m/s²
      highest = std::max(highest, now.position.z());
      last = now;
    }
    EXPECT_LT((swing.At(swing.end()).position - swing.foothold()).norm(), 1e-9);
    EXPECT_NEAR(swing.At(swing.end()).velocity.z(), -0.25, 1e-9);
    EXPECT_NEAR(swing.At(swing.end()).velocity.head<2>().norm(), 0, 1e-9);
    EXPECT_GE(highest, std::min(start.z(), swing.foothold().z()) + 0.045);
    // The ground is deeper: on downward, as fast.
    EXPECT_NEAR(swing.At(swing.end() + 0.1).position.z(), swing.foothold().z() - 0.025, 1e-9);
  }
}

TEST(Swing, RisesBeforeItGoesAcrossWhereItIsToldTo) {
  Swing swing;
  const SwingSpec spec{
      .clearance = 0.05, .touch_speed = 0.1, .freeze = 0.1, .across = 0.65, .wait = 0.25};
  const Vector3d from(0.1, 0.2, 0), to(0.5, 0.22, 0.2);
  swing.Begin({.position = from}, Eigen::Matrix3d::Identity(), to, Eigen::Matrix3d::Identity(), 2,
              3, spec);
  Vector3d last = from;
  for (int i = 0; i <= 1000; ++i) {
    const double time = 2 + 1e-3 * i;
    const PointMotion at = swing.At(time);
    if (time <= 2.25) {
      EXPECT_EQ(at.position.x(), from.x());
      EXPECT_EQ(at.velocity.x(), 0);
    }
    // Its velocity is its position's rate.
    if (i > 0) {
      EXPECT_NEAR(at.position.x() - last.x(), 1e-3 * at.velocity.x(), 1e-5) << time;
      EXPECT_NEAR(at.position.z() - last.z(), 1e-3 * at.velocity.z(), 1e-5) << time;
    }
    if (time >= 2.65) {
      EXPECT_NEAR(at.position.x(), to.x(), 1e-12);
    }
    last = at.position;
  }
  EXPECT_GT(swing.At(2.25).position.z(), 0.1);
  EXPECT_NEAR(last.z(), to.z(), 1e-9);
}

TEST(Swing, RisesStraightUpForAsLongAsItIsTo) {
  for (const double across : {0.65, 1.0}) {
    SwingSpec spec{.clearance = 0.05, .touch_speed = 0.1, .freeze = 0.1};
    spec.across = across;
    spec.wait = 0.25;
    Swing swing;
    swing.Begin({}, Eigen::Matrix3d::Identity(), {0.2, 0, 0.1}, Eigen::Matrix3d::Identity(), 0, 1,
                spec);
    for (int tick = 1; tick <= 125; ++tick) {
      const PointMotion now = swing.At(0.002 * tick);
      EXPECT_EQ(now.position.head<2>().norm() + now.velocity.head<2>().norm(), 0) << tick;
    }
    EXPECT_NEAR(swing.At(across).position.x(), 0.2, 1e-9) << across;
  }
}

TEST(Swing, TheTurnEndsLevel) {
  const Eigen::Matrix3d tilted =
      Eigen::AngleAxisd(0.3, Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Swing swing;
  swing.Begin({}, tilted, {0.2, 0, 0}, Eigen::Matrix3d::Identity(), 1, 1.4, {0.05, 0.2, 0.05});
  EXPECT_LT((swing.RotationAt(1).rotation - tilted).norm(), 1e-12);
  EXPECT_LT((swing.RotationAt(1.4).rotation - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  const double dt = 1e-5;
  for (double time = 1.01; time < 1.4; time += 0.013) {
    const Eigen::Matrix3d change =
        swing.RotationAt(time + dt).rotation * swing.RotationAt(time - dt).rotation.transpose();
    const Eigen::AngleAxisd turn(change);
    EXPECT_LT(
        (turn.angle() / (2 * dt) * turn.axis() - swing.RotationAt(time).angular_velocity).norm(),
        1e-5);
  }
}

class ReachCase : public testing::TestWithParam<TestRobot> {
 protected:
  robot::RobotModel model_ = robot::LoadTestRobot(GetParam());
  double height_ = robot::StandingHeight(model_);
  double lower_ = 0.08 * height_;
};

TEST_P(ReachCase, OnlyALegThatComesNearerByItLowersTheCom) {
  const Reach reach(model_, height_, lower_, 0.02);
  std::mt19937 random{TestSeed(164)};
  std::uniform_real_distribution<double> any(-0.4, 0.4);
  int lowered = 0, useless = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const robot::FootArray<Vector2d> offset{Vector2d(any(random), any(random)),
                                            Vector2d(any(random), any(random))};
    const auto outside = [&](Foot foot, double share) {
      return std::max(0.0, -balance::SignedDistance(reach.Leg(foot, share), offset[foot]));
    };
    const bool nearer = std::ranges::any_of(
        robot::kFeet, [&](Foot foot) { return outside(foot, 1) < outside(foot, 0) - 1e-12; });
    const double share = reach.UsefulLowering(offset);
    EXPECT_TRUE(share >= 0 && share <= 1) << share;
    EXPECT_EQ(share > 0, nearer) << share;
    lowered += share > 0;
    useless += share == 0 && reach.LoweringShare(offset) > 1;
  }
  EXPECT_GT(lowered, 20);
  EXPECT_GT(useless, 20);
}

// The posture solver, which knows nothing of the polygons, stands where they say.
TEST_P(ReachCase, APostureExistsWhereverTheyReach) {
  const Reach reach(model_, height_, lower_, 0.02);
  ASSERT_FALSE(reach.empty());
  std::mt19937 random{TestSeed(163)};
  std::uniform_real_distribution<double> any(-1, 1);
  int solved = 0, tried = 0;
  for (int trial = 0; trial < 4000 && tried < 40; ++trial) {
    // Feet symmetric about the COM: then the legs' mass does not move it against the body.
    const double share = 0.5 + 0.5 * any(random);
    const Vector2d right(0.6 * any(random), -0.3 + 0.3 * any(random));
    const Vector2d left(-right.x(), -right.y());
    if (balance::SignedDistance(reach.Leg(Foot::kRight, share), right) < 0.01 ||
        balance::SignedDistance(reach.Leg(Foot::kLeft, share), left) < 0.01) {
      continue;
    }
    ++tried;
    EXPECT_LE(reach.LoweringShare({right, left}), share + 1e-9);
    robot::PostureGoal goal;
    goal.foot[0] = Eigen::Translation3d(right.x(), right.y(), 0) * Eigen::Isometry3d::Identity();
    goal.foot[1] = Eigen::Translation3d(left.x(), left.y(), 0) * Eigen::Isometry3d::Identity();
    goal.com_height = height_ - share * lower_;
    goal.nominal = model_.stance().joint_position;
    try {
      robot::SolvePosture(model_, goal);
      ++solved;
    } catch (const robot::RobotError& error) {
      ADD_FAILURE() << right.transpose() << " lowered " << share << ": " << error.what();
    }
  }
  EXPECT_GE(tried, 40);
  EXPECT_EQ(solved, tried);
}

TEST_P(ReachCase, FootholdsAreBesideTheOtherSole) {
  const Reach reach(model_, height_, lower_, 0.02);
  for (const Foot foot : kFeet) {
    const balance::ConvexPolygon footholds = reach.Footholds(foot, {0.05, 0});
    ASSERT_GE(footholds.num_corners, 3);
    for (const Vector2d& corner : footholds.corners()) {
      EXPECT_GE(Side(foot) * corner.y(), reach.least_spacing() - 1e-12);
    }
  }
}

// Where a foothold of a fine grid within reach, at the same time, holds the capture point well
// inside, the chosen one is within 2 cm of holding it.
TEST_P(ReachCase, NoFootholdIsMuchBetterThanTheChosen) {
  const double spacing = robot::StandingSpacing(model_);
  const Reach reach(model_, height_, lower_, 0.02);
  StepLimits limits{.sole_margin = 0.01,
                    .acceleration = 25,
                    .least_swing = 0.2,
                    .unload = 0.04,
                    .overshoot = 0.04,
                    .ample_margin = 0.03,
                    .spacing = spacing};
  const StepChoice choice(model_, reach, limits);
  std::mt19937 random{TestSeed(164)};
  std::uniform_real_distribution<double> any(-1, 1);
  int possible = 0;
  for (int trial = 0; trial < 120; ++trial) {
    StepState state;
    state.pendulum.frequency = std::sqrt(kGravity / height_);
    const double angle = M_PI * any(random), speed = 0.75 + 0.5 * any(random);
    state.pendulum.velocity = speed * Vector2d(std::cos(angle), std::sin(angle));
    state.sole = {Vector2d(0, -0.5 * spacing), Vector2d(0, 0.5 * spacing)};
    for (const Foot foot : kFeet) {
      const StepPlan plan = choice.Plan(state, foot, limits.unload);
      ASSERT_EQ(plan.foot, foot);
      EXPECT_GE(plan.time, limits.unload + limits.least_swing - 1e-12);
      const auto stance = robot::Index(Other(foot));
      constexpr double kLowered = StepChoice::CountedLowering(Crossing::kNone);
      const balance::ConvexPolygon footholds =
          reach.Footholds(foot, plan.com - state.sole[stance], Crossing::kNone, kLowered);
      if (footholds.num_corners < 3) continue;
      double best = -1;
      for (double x = -1; x < 1; x += 0.02) {
        for (double y = -1; y < 1; y += 0.02) {
          if (balance::SignedDistance(footholds, {x, y}) < 0) continue;
          const balance::ConvexPolygon soles =
              HullOf(SoleAt(model_.feet()[stance], limits.sole_margin, state.sole[stance], 0),
                     SoleAt(model_.feet()[robot::Index(foot)], limits.sole_margin,
                            state.sole[stance] + Vector2d(x, y), 0));
          best = std::max(best, balance::SignedDistance(soles, plan.capture_point));
        }
      }
      // A step that the stance leg cannot follow counts as worse, wherever the foot goes.
      const Vector2d behind = state.sole[stance] - plan.com;
      if (best < limits.ample_margin ||
          !balance::Contains(reach.Leg(Other(foot), kLowered), behind))
        continue;
      ++possible;
      EXPECT_GE(plan.margin, -0.02) << "foot " << robot::Index(foot) << ", velocity "
                                    << state.pendulum.velocity.transpose() << ", best " << best;
    }
  }
  EXPECT_GT(possible, 20);
}

double Support(const balance::ConvexPolygon& polygon, const Vector2d& direction) {
  double most = -1e9;
  for (const Vector2d& corner : polygon.corners()) most = std::max(most, corner.dot(direction));
  return most;
}

// m that `foothold`, from the stance sole, is beyond what both legs span, wherever the COM is:
// outside some half-plane of the sum of one leg's polygon and the other's turned round.
double BeyondSpan(const Reach& reach, Foot foot, const Vector2d& foothold) {
  double beyond = -1e9;
  for (int i = 0; i < 360; ++i) {
    const Vector2d direction(std::cos(i * M_PI / 180), std::sin(i * M_PI / 180));
    beyond = std::max(beyond, foothold.dot(direction) - Support(reach.Leg(foot, 1), direction) -
                                  Support(reach.Leg(Other(foot), 1), -direction));
  }
  return beyond;
}

// However fast the robot falls: the prediction runs away as e^ωT, the foothold does not.
TEST_P(ReachCase, NoFootholdIsBeyondWhatBothLegsSpan) {
  const Reach reach(model_, height_, lower_, 0.02);
  const StepLimits limits{.sole_margin = 0.01,
                          .acceleration = 25,
                          .least_swing = 0.2,
                          .unload = 0.04,
                          .overshoot = 0.04,
                          .ample_margin = 0.03,
                          .spacing = robot::StandingSpacing(model_),
                          .leg_distance = 0.12};
  const StepChoice choice(model_, reach, limits);
  const double frequency = std::sqrt(kGravity / height_), far = model_.feet()[0].length + 1e-6;
  std::mt19937 random{TestSeed(165)};
  std::uniform_real_distribution<double> any(-1, 1);
  int chosen = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    StepState state;
    state.pendulum.frequency = frequency;
    state.yaw = 3 * any(random);
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(state.yaw).toRotationMatrix();
    const double fastest = trial % 3 == 0 ? 0.4 : trial % 3 == 1 ? 1.5 : 8;
    state.pendulum.com = 0.3 * Vector2d(any(random), any(random));
    state.pendulum.velocity = fastest * Vector2d(any(random), any(random));
    const Vector2d apart =
        turn * Vector2d(0.3 * any(random), limits.spacing * (1.2 + 0.3 * any(random)));
    state.sole = {Vector2d(-0.5 * apart), Vector2d(0.5 * apart)};
    state.sole_yaw = {state.yaw, state.yaw + 0.2 * any(random)};
    if (trial % 4 > 1) state.in_contact[static_cast<size_t>(trial % 2)] = false;
    const auto from_stance = [&](const StepPlan& plan) -> Vector2d {
      return turn.transpose() * (plan.foothold - state.sole[robot::Index(Other(plan.foot))]);
    };
    for (const Foot foot : kFeet) {
      for (const Crossing crossing : {Crossing::kNone, Crossing::kInFront, Crossing::kBehind}) {
        const StepPlan plan = choice.At(state, foot, 1 + any(random), crossing);
        ASSERT_TRUE(plan.foothold.allFinite());
        if (!std::isfinite(plan.margin)) continue;
        ASSERT_LT(BeyondSpan(reach, foot, from_stance(plan)), far) << trial;
      }
    }
    const StepPlan plan = choice.Choose(state);
    if (!plan.possible) continue;
    ++chosen;
    ASSERT_TRUE(std::isfinite(plan.margin) && plan.foothold.allFinite());
    ASSERT_LT(BeyondSpan(reach, plan.foot, from_stance(plan)), far) << trial;
    ASSERT_LE(plan.time, 4 / frequency) << trial;
  }
  EXPECT_GT(chosen, 100);
}

INSTANTIATE_TEST_SUITE_P(Robots, ReachCase, testing::Values(TestRobot::kDyros, TestRobot::kMantis));

}  // namespace
}  // namespace poise::stepping
