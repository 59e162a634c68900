// The hip strategy against a linear inverted pendulum with a flywheel, whose capture point p + (ξ −
// p) follows in closed form from the flywheel's acceleration.
#include "components/step_planner/hip_strategy.h"

#include <gtest/gtest.h>

#include <cmath>

namespace poise {
namespace {

using Eigen::Vector3d;
using State = HipStrategy::State;

constexpr double kTick = 0.002;

// Pushed along +x: ξ' = ω (ξ − p − I α / (m g)), with the centre of pressure p at the edge while ξ
// needs it there and under ξ before. The robot's figures, and its tilting body's effective inertia.
class Pendulum {
 public:
  static constexpr double kMass = 55, kGravity = 9.81, kHeight = 0.75, kInertia = 1.4;
  static constexpr double kEdge = 0.15;  // m
  static constexpr int kSteps = 50;      // in a tick

  static double frequency() { return std::sqrt(kGravity / kHeight); }
  // Moment pivot's shift per acceleration, m/(rad/s²).
  static double lever() { return kInertia / (kMass * kGravity); }

  // True when it is brought to rest from there; the body follows its reference.
  bool Captures(double capture_point) {
    double x = capture_point;
    for (int tick = 0; tick < 3000; ++tick) {
      const double time = kTick * tick;
      double excess = x - (kEdge - HipStrategy::kStart);
      const PointMotion tilt = hip_.Update(
          {.time = time, .excess = Vector3d(std::max(excess, 0.0), 0, 0), .margin = -excess});
      largest_tilt_ = std::max(largest_tilt_, tilt.position.y());
      EXPECT_EQ(tilt.position.x(), 0);
      // A centre of pressure that draws the capture point back to the middle.
      const double pressure = std::min(kEdge, 2 * x);
      const double pivot = pressure + lever() * tilt.acceleration.y();
      x = pivot + (x - pivot) * std::exp(frequency() * kTick);
      if (x > 1) return false;
    }
    return std::abs(x) < kEdge;
  }
  State state() const { return hip_.state(); }
  double largest_tilt() const { return largest_tilt_; }

 private:
  HipStrategy hip_;
  double largest_tilt_ = 0;
};

TEST(HipStrategy, CaptureRegionGrowsByTheFlywheelsShare) {
  // ω I / (m g) ∫ α e^{−ωt} dt over the turn of minimum jerk, by its acceleration's formula. The
  // return comes when the capture point is back and takes nothing.
  const double tilt = HipStrategy::kTilt, tilt_time = HipStrategy::kTiltTime;
  double integral = 0;
  constexpr int kPieces = 10000;
  for (int i = 0; i < kPieces; ++i) {
    const double s = (i + 0.5) / kPieces;
    const double acceleration =
        tilt / (tilt_time * tilt_time) * (60 * s - 180 * s * s + 120 * s * s * s);
    integral +=
        acceleration * std::exp(-Pendulum::frequency() * s * tilt_time) * tilt_time / kPieces;
  }
  const double growth = Pendulum::frequency() * Pendulum::lever() * integral;
  ASSERT_GT(growth, 0.003);
  double inside = 0, outside = 1;
  while (outside - inside > 1e-6) {
    const double middle = 0.5 * (inside + outside);
    (Pendulum().Captures(middle) ? inside : outside) = middle;
  }
  // A tick's reference is held over the tick.
  EXPECT_NEAR(inside, Pendulum::kEdge + growth, 0.02 * growth);
}

TEST(HipStrategy, TurnsOnceAndComesBack) {
  Pendulum pendulum;
  EXPECT_TRUE(pendulum.Captures(Pendulum::kEdge));
  EXPECT_NEAR(pendulum.largest_tilt(), HipStrategy::kTilt, 1e-9);
  EXPECT_EQ(pendulum.state(), State::kUpright);
  Pendulum small;
  EXPECT_TRUE(small.Captures(Pendulum::kEdge - HipStrategy::kStart - 0.001));
  EXPECT_EQ(small.largest_tilt(), 0);
}

TEST(HipStrategy, TheHeadFollowsTheCapturePoint) {
  for (int i = 0; i < 16; ++i) {
    HipStrategy hip;
    const double angle = i * std::acos(-1.0) / 8;
    const Vector3d direction(std::cos(angle), std::sin(angle), 0);
    hip.Update({.time = 0, .excess = 0.01 * direction, .margin = -0.01});
    const Vector3d tilt = hip.Update({.time = 1, .excess = 0.01 * direction}).position;
    EXPECT_NEAR(tilt.norm(), HipStrategy::kTilt, 1e-12);
    const Vector3d head = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * Vector3d::UnitZ();
    EXPECT_NEAR(head.dot(direction), std::sin(HipStrategy::kTilt), 1e-12);
  }
}

TEST(HipStrategy, BrakesBeforeAJointsLimit) {
  HipStrategy hip;
  const Vector3d excess(0, 0.01, 0);
  for (int tick = 0; tick < 60; ++tick) hip.Update({.time = kTick * tick, .excess = excess});
  const PointMotion before =
      hip.Update({.time = kTick * 60, .excess = excess, .near_joint_limit = true});
  ASSERT_LT(before.velocity.x(), -0.5);
  EXPECT_EQ(hip.state(), State::kTilted);
  PointMotion last = before;
  for (int tick = 61; tick < 200; ++tick) {
    const PointMotion now =
        hip.Update({.time = kTick * tick, .excess = excess, .near_joint_limit = true});
    EXPECT_LT((now.velocity - last.velocity).norm(), 0.2);  // rad/s: no step
    last = now;
  }
  EXPECT_EQ(last.velocity.norm(), 0);
  // Braked evenly the body goes on for half the time at its speed.
  EXPECT_NEAR(last.position.x(), before.position.x() + 0.06 * before.velocity.x(), 1e-12);
}

TEST(HipStrategy, AnotherPushOnTheWayBackTurnsItAgainWithoutAStep) {
  HipStrategy hip;
  PointMotion last;
  double turned = 0;
  for (int tick = 0; tick < 1500; ++tick) {
    const double time = kTick * tick;
    const bool pushed = tick < 5 || (tick > 500 && tick < 505);
    const PointMotion now = hip.Update({.time = time,
                                        .excess = Vector3d(pushed ? 0.01 : 0, 0, 0),
                                        .margin = pushed ? -0.01 : 0.1});
    EXPECT_LT((now.position - last.position).norm(), 0.01);
    EXPECT_LT((now.velocity - last.velocity).norm(), 0.1);
    last = now;
    if (tick > 500) turned = std::max(turned, now.position.y());
  }
  EXPECT_NEAR(turned, HipStrategy::kTilt, 1e-3);
  EXPECT_LT(last.position.norm(), 1e-12);
  EXPECT_EQ(hip.state(), State::kUpright);
}

}  // namespace
}  // namespace poise
