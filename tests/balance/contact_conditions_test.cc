#include "components/balance/contact_conditions.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/test_seed.h"

namespace poise::balance {
namespace {

Eigen::Isometry3d Pose(double x, double y, double z, double roll = 0, double pitch = 0,
                       double yaw = 0) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() << x, y, z;
  return pose;
}

TEST(CheckContact, MarginsOfAWrenchByHand) {
  const ContactLimits limits{0.9, 0.2, 0.12, 0.05, {}};
  Vector6d w;
  w << 30, -40, -100, 4, -11, 19;
  const ContactMargins m = CheckContact(w, limits);
  EXPECT_DOUBLE_EQ(m.normal, 100);
  EXPECT_DOUBLE_EQ(m.friction, 90 - 50);
  EXPECT_DOUBLE_EQ(m.yaw, 20 - 19);
  EXPECT_DOUBLE_EQ(m.roll, 5 - 4);
  EXPECT_DOUBLE_EQ(m.pitch, 12 - 11);
  EXPECT_TRUE(m.Met());
  EXPECT_TRUE(CheckContact(-w, limits).normal < 0);
  EXPECT_FALSE(CheckContact(-w, limits).Met());
}

TEST(CheckContact, EachConditionAloneDecides) {
  const ContactLimits limits{0.9, 0.2, 0.12, 0.05, {}};
  const Vector6d good = (Vector6d() << 0, 0, -100, 0, 0, 0).finished();
  ASSERT_TRUE(CheckContact(good, limits).Met());
  const double limit[6] = {90, 90, 0, 5, 12, 20};
  for (const int i : {0, 1, 3, 4, 5}) {
    for (const double sign : {1.0, -1.0}) {
      Vector6d w = good;
      w(i) = sign * limit[i] * 1.001;
      EXPECT_FALSE(CheckContact(w, limits).Met()) << i;
      w(i) = sign * limit[i] * 0.999;
      EXPECT_TRUE(CheckContact(w, limits).Met()) << i;
    }
  }
  for (int i = 0; i < 6; ++i) {
    Vector6d w = good;
    w(i) = std::nan("");
    EXPECT_FALSE(CheckContact(w, limits).Met()) << i;
  }
}

TEST(CenterOfPressure, IsWhereAPushActs) {
  // The robot pushes the ground down with 200 N at (0.03, −0.02): the moment about the origin is r
  // × F.
  const Eigen::Vector3d at(0.03, -0.02, 0), force(0, 0, -200);
  Vector6d w;
  w << force, at.cross(force);
  EXPECT_LT((CenterOfPressure(w) - at.head<2>()).norm(), 1e-15);
}

TEST(FrameO, IsMidwayWithYAlongTheFeet) {
  Eigen::Isometry3d frame;
  ASSERT_TRUE(FrameO({Pose(1, -0.1, 0), Pose(1.2, 0.1, 0.04)}, {true, true}, &frame));
  EXPECT_LT((frame.translation() - Eigen::Vector3d(1.1, 0, 0.02)).norm(), 1e-15);
  const Eigen::Vector3d line = Eigen::Vector3d(0.2, 0.2, 0.04).normalized();
  EXPECT_LT((frame.linear().col(1) - line).norm(), 1e-15);
  // z: the world's vertical without its part along the line.
  const Eigen::Vector3d up = (Eigen::Vector3d::UnitZ() - line.z() * line).normalized();
  EXPECT_LT((frame.linear().col(2) - up).norm(), 1e-14);
  EXPECT_NEAR(frame.linear().determinant(), 1, 1e-14);
}

TEST(FrameO, OneFootIsItsSole) {
  const std::array<Eigen::Isometry3d, 2> sole{Pose(1, -0.1, 0, 0.1), Pose(1.2, 0.1, 0.04, 0, 0.2)};
  Eigen::Isometry3d frame;
  ASSERT_TRUE(FrameO(sole, {true, false}, &frame));
  EXPECT_TRUE(frame.isApprox(sole[0]));
  ASSERT_TRUE(FrameO(sole, {false, true}, &frame));
  EXPECT_TRUE(frame.isApprox(sole[1]));
}

TEST(FrameO, RefusesWhatDefinesNoFrame) {
  Eigen::Isometry3d frame = Pose(7, 7, 7);
  const Eigen::Isometry3d before = frame;
  EXPECT_FALSE(FrameO({Pose(0, 0, 0), Pose(0, 0.2, 0)}, {false, false}, &frame));
  EXPECT_FALSE(FrameO({Pose(1, 2, 0), Pose(1, 2, 0)}, {true, true}, &frame));
  EXPECT_FALSE(
      FrameO({Pose(0, 0, 0), Pose(0, 0, 0.3)}, {true, true}, &frame));  // one above the other
  Eigen::Isometry3d broken = Pose(0, 0, 0);
  broken.translation().y() = std::nan("");
  EXPECT_FALSE(FrameO({broken, Pose(0, 0.2, 0)}, {true, true}, &frame));
  EXPECT_FALSE(FrameO({broken, Pose(0, 0.2, 0)}, {true, false}, &frame));
  broken = Pose(0, 0, 0);
  broken.linear()(2, 2) = std::nan("");
  EXPECT_FALSE(FrameO({Pose(0, 0, 0), broken}, {true, true}, &frame));
  EXPECT_TRUE(frame.matrix() == before.matrix());
}

TEST(WrenchTransform, MovesForcesAndTheirMoments) {
  std::mt19937_64 random(TestSeed(1));
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d frame =
        Pose(u(random), u(random), u(random), u(random), u(random), u(random));
    const Eigen::Isometry3d sole =
        Pose(u(random), u(random), u(random), u(random), u(random), u(random));
    Vector6d w;
    for (double& x : w) x = u(random);
    const Vector6d moved = WrenchTransform(frame, sole) * w;
    // In world axes about the frame's origin.
    const Eigen::Vector3d force = sole.linear() * w.head<3>();
    const Eigen::Vector3d moment =
        sole.linear() * w.tail<3>() + (sole.translation() - frame.translation()).cross(force);
    EXPECT_LT((frame.linear() * moved.head<3>() - force).norm(), 1e-14);
    EXPECT_LT((frame.linear() * moved.tail<3>() - moment).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace poise::balance
