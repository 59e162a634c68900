// The capture point against the linear inverted pendulum integrated in time.
#include "components/balance/capture_point.h"

#include <gtest/gtest.h>

#include <cmath>

namespace poise::balance {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kGravity = 9.80665;

// c̈ = (g/h)(c − p) − τ/(m h) by small steps, τ per mass the feet's moment that stops the body's
// turning.
struct Pendulum {
  Vector2d c, v;
  void Run(double h, const Vector2d& p, double duration) {
    const int steps = 200000;
    const double dt = duration / steps;
    for (int i = 0; i < steps; ++i) {
      // Velocity first, to the middle: second order.
      v += 0.5 * dt * kGravity / h * (c - p);
      c += dt * v;
      v += 0.5 * dt * kGravity / h * (c - p);
    }
  }
};

TEST(CapturePoint, APressureKeptThereBringsTheComToRestAboveIt) {
  const double h = 0.75;
  const Vector3d com(0.02, -0.01, h), velocity(0.3, -0.2, 0);
  CapturePoint capture;
  ASSERT_TRUE(ComputeCapturePoint(Eigen::Isometry3d::Identity(), com, velocity, Vector3d::Zero(),
                                  kGravity, &capture));
  EXPECT_NEAR(capture.frequency, std::sqrt(kGravity / h), 1e-15);
  Pendulum pendulum{com.head<2>(), velocity.head<2>()};
  pendulum.Run(h, capture.position, 3);
  EXPECT_LT((pendulum.c - capture.position).norm(), 1e-5);
  EXPECT_LT(pendulum.v.norm(), 1e-4);
}

TEST(CapturePoint, IsWhereTheVerticalMeetsATiltedPlane) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = Eigen::AngleAxisd(0.4, Vector3d::UnitX()).toRotationMatrix();
  frame.translation() = Vector3d(1, 2, 3);
  const Vector3d com(1.1, 2.05, 3.8), velocity(0.2, 0.1, 0.3);
  CapturePoint capture;
  ASSERT_TRUE(ComputeCapturePoint(frame, com, velocity, Vector3d::Zero(), kGravity, &capture));
  // The plane rises by tan 0.4 per m of y.
  const double h = com.z() - (3 + std::tan(0.4) * 0.05), omega = std::sqrt(kGravity / h);
  EXPECT_NEAR(capture.frequency, omega, 1e-12);
  const Vector3d at = frame * Vector3d(capture.position.x(), capture.position.y(), 0);
  EXPECT_NEAR(at.x(), com.x() + velocity.x() / omega, 1e-12);
  EXPECT_NEAR(at.y(), com.y() + velocity.y() / omega, 1e-12);
  EXPECT_NEAR(at.z(), 3 + std::tan(0.4) * (at.y() - 2), 1e-12);
}

// A momentum about a point of the ground is the same whether the COM moves or the body turns.
TEST(CapturePoint, AngularMomentumCountsAsTheMomentumAboutTheGround) {
  const Vector3d com(0, 0, 0.8), velocity(0.25, -0.15, 0);
  CapturePoint moving, turning;
  const Eigen::Isometry3d level = Eigen::Isometry3d::Identity();
  ASSERT_TRUE(ComputeCapturePoint(level, com, velocity, Vector3d::Zero(), kGravity, &moving));
  ASSERT_TRUE(
      ComputeCapturePoint(level, com, Vector3d::Zero(), com.cross(velocity), kGravity, &turning));
  EXPECT_LT((moving.position - turning.position).norm(), 1e-15);
}

TEST(CapturePoint, NeedsAComAboveThePlane) {
  CapturePoint capture;
  capture.frequency = 7;
  const Eigen::Isometry3d level = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d upright = level;
  upright.linear() = Eigen::AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  const Vector3d none = Vector3d::Zero();
  EXPECT_FALSE(ComputeCapturePoint(level, {0, 0, -0.1}, none, none, kGravity, &capture));
  EXPECT_FALSE(ComputeCapturePoint(upright, {0, 0, 1}, none, none, kGravity, &capture));
  EXPECT_FALSE(ComputeCapturePoint(level, {0, NAN, 1}, none, none, kGravity, &capture));
  EXPECT_FALSE(ComputeCapturePoint(level, {0, 0, 1}, {0, INFINITY, 0}, none, kGravity, &capture));
  EXPECT_EQ(capture.frequency, 7);
}

// Where the pendulum's capture point really is when its centre of pressure stays at the edge.
TEST(LatestStep, IsWhereTheCapturePointHasRunTo) {
  const double h = 0.75, reach = 0.4;
  const ConvexPolygon support = Rectangle({0.15, 0.18});
  const Vector3d com(0.05, 0.1, h), velocity(0.2, 0.6, 0);
  CapturePoint capture;
  ASSERT_TRUE(ComputeCapturePoint(Eigen::Isometry3d::Identity(), com, velocity, Vector3d::Zero(),
                                  kGravity, &capture));
  ASSERT_LT(SignedDistance(support, capture.position), -0.05);
  const Step step = LatestStep(support, capture, reach);
  ASSERT_GT(step.time, 0.1);
  const Vector2d edge = NearestPoint(support, capture.position);
  Pendulum pendulum{com.head<2>(), velocity.head<2>()};
  pendulum.Run(h, edge, step.time);
  const Vector2d then = pendulum.c + pendulum.v / capture.frequency;
  EXPECT_LT((then - step.position).norm(), 1e-6);
  EXPECT_NEAR((step.position - edge).norm(), reach, 1e-12);
}

TEST(LatestStep, IsNowWhenTheCapturePointIsBeyondReach) {
  CapturePoint capture;
  capture.position = {0.9, 0};
  capture.frequency = 3.5;
  const Step step = LatestStep(Rectangle({0.15, 0.18}), capture, 0.4);
  EXPECT_EQ(step.time, 0);
  EXPECT_EQ(step.position, capture.position);
}

}  // namespace
}  // namespace poise::balance
