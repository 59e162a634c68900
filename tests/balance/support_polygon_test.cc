// The soles' hull, and that it is what the feet can really do.
#include "components/balance/support_polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "components/balance/distribution_ratio.h"
#include "tests/test_seed.h"

namespace poise::balance {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Eigen::Isometry3d Sole(const Vector3d& at, const Vector3d& rotation = Vector3d::Zero()) {
  Eigen::Isometry3d sole = Eigen::Isometry3d::Identity();
  sole.translation() = at;
  if (rotation.norm() > 0) {
    sole.linear() = Eigen::AngleAxisd(rotation.norm(), rotation.normalized()).toRotationMatrix();
  }
  return sole;
}

ConvexPolygon Polygon(const ContactGeometry& geometry, const Vector2d& half,
                      Eigen::Isometry3d* frame_o) {
  EXPECT_TRUE(FrameO(geometry.sole, geometry.in_contact, frame_o));
  return SupportPolygon(*frame_o, geometry, {Rectangle(half), Rectangle(half)});
}

Vector2d HalfExtent(const ConvexPolygon& polygon) {
  Vector2d extent = Vector2d::Zero();
  for (const Vector2d& corner : polygon.corners()) extent = extent.cwiseMax(corner.cwiseAbs());
  return extent;
}

TEST(SupportPolygon, OfOneSoleIsItsRectangleHoweverItStands) {
  ContactGeometry geometry;
  geometry.sole = {Sole({3, -2, 0.4}, {0.1, -0.2, 0.7}), Sole({0, 0, 0})};
  geometry.in_contact = {true, false};
  Eigen::Isometry3d frame_o;
  const ConvexPolygon polygon = Polygon(geometry, {0.14, 0.065}, &frame_o);
  ASSERT_EQ(polygon.num_corners, 4);
  for (const Vector2d& corner : polygon.corners()) {
    EXPECT_NEAR(std::abs(corner.x()), 0.14, 1e-14);
    EXPECT_NEAR(std::abs(corner.y()), 0.065, 1e-14);
  }
}

TEST(SupportPolygon, OfSolesAtDifferentHeightsIsSeenAlongTheNormalOfFrameO) {
  const double apart = 0.21, rise = 0.12;
  ContactGeometry geometry;
  geometry.sole = {Sole({0, -0.5 * apart, 0}), Sole({0, 0.5 * apart, rise})};
  Eigen::Isometry3d frame_o;
  const ConvexPolygon polygon = Polygon(geometry, {0.15, 0.075}, &frame_o);
  const double line = std::hypot(apart, rise), cosine = apart / line;
  const Vector2d extent = HalfExtent(polygon);
  EXPECT_NEAR(extent.x(), 0.15, 1e-14);
  EXPECT_NEAR(extent.y(), 0.5 * line + 0.075 * cosine, 1e-14);
}

TEST(SupportPolygon, ATurnedSoleReachesAsFarAsItsCorners) {
  ContactGeometry geometry;
  const double yaw = 0.3;
  geometry.sole = {Sole({0, -0.1, 0}, {0, 0, -yaw}), Sole({0, 0.1, 0}, {0, 0, yaw})};
  Eigen::Isometry3d frame_o;
  const ConvexPolygon polygon = Polygon(geometry, {0.15, 0.075}, &frame_o);
  const Vector2d extent = HalfExtent(polygon);
  EXPECT_NEAR(extent.x(), 0.15 * std::cos(yaw) + 0.075 * std::sin(yaw), 1e-14);
  EXPECT_NEAR(extent.y(), 0.1 + 0.15 * std::sin(yaw) + 0.075 * std::cos(yaw), 1e-14);
}

// Feet level and parallel, one ahead of the other: a centre of pressure in the hull of the smaller
// soles can be shared so that each foot's own centre of pressure is in its smaller sole, and one
// outside cannot, by any share.
TEST(SupportPolygon, IsWhatTheFeetCanDo) {
  std::mt19937 random(TestSeed(11));
  std::uniform_real_distribution<double> uniform(-1, 1);
  int inside = 0, outside = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    ContactGeometry geometry;
    geometry.sole = {Sole({0, 0, 0}), Sole({0.15 * uniform(random), 0.2, 0})};
    const Vector2d half(0.12, 0.05);
    Eigen::Isometry3d frame_o;
    const ConvexPolygon polygon = Polygon(geometry, half, &frame_o);
    const Vector2d cop(0.25 * uniform(random), 0.25 * uniform(random));
    const double distance = SignedDistance(polygon, cop);
    if (std::abs(distance) < 1e-9) continue;
    Vector6d resultant;
    resultant << 0, 0, -500, -500 * cop.y(), 500 * cop.x(), 0;
    ContactLimits limits;
    limits.half_length = half.x();
    limits.half_width = half.y();
    const std::array<Eigen::Isometry3d, 2> foot{frame_o.inverse() * geometry.sole[0],
                                                frame_o.inverse() * geometry.sole[1]};
    EXPECT_EQ(FeasibleRatio(resultant, foot, limits, 0, 1).feasible, distance > 0)
        << "CoP " << cop.transpose() << ", distance " << distance;
    (distance > 0 ? inside : outside) += 1;
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
}

}  // namespace
}  // namespace poise::balance
