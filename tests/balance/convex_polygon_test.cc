// Polygons of the plane against closed forms and against brute force.
#include "components/balance/convex_polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/test_seed.h"

namespace poise::balance {
namespace {

using Eigen::Vector2d;

double Area(const ConvexPolygon& polygon) {
  double twice = 0;
  for (int i = 0; i < polygon.num_corners; ++i) {
    const Vector2d& a = polygon.corner[static_cast<size_t>(i)];
    const Vector2d& b = polygon.corner[static_cast<size_t>((i + 1) % polygon.num_corners)];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

TEST(ConvexHull, OfTwoLevelSolesSideBySideIsARectangle) {
  std::vector<Vector2d> corners;
  for (const double y : {-0.105, 0.105}) {
    for (const double dx : {-0.15, 0.15}) {
      for (const double dy : {-0.075, 0.075}) corners.push_back({dx, y + dy});
    }
  }
  const ConvexPolygon hull = ConvexHull(corners);
  ASSERT_EQ(hull.num_corners, 4);
  EXPECT_NEAR(Area(hull), 0.30 * 0.36, 1e-15);
}

// Soles level to rounding, or to what an estimate is off by: their corners along y stand in any
// order by x. At 1e-9 m hulls once went round twice.
TEST(ConvexHull, OfSolesAlignedNearlyIsTheirRectangle) {
  std::mt19937 random(TestSeed(31));
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 20000; ++trial) {
    const double size = std::pow(10.0, -10.5 + 4.5 * uniform(random));  // 1e-15 to 1e-6 m
    std::vector<Vector2d> corners;
    for (const double y : {-0.1, 0.1}) {
      for (const double dx : {-0.105, 0.105}) {
        for (const double dy : {-0.05, 0.05}) {
          corners.push_back({dx + size * uniform(random), y + dy + size * uniform(random)});
        }
      }
    }
    const ConvexPolygon hull = ConvexHull(corners);
    ASSERT_LE(hull.num_corners, 8) << trial;
    ASSERT_NEAR(Area(hull), 0.21 * 0.3, 2 * size + 1e-8) << trial;
    double perimeter = 0;
    for (int i = 0; i < hull.num_corners; ++i) {
      const auto at = [&](int j) { return hull.corner[static_cast<size_t>(j % hull.num_corners)]; };
      perimeter += (at(i + 1) - at(i)).norm();
    }
    ASSERT_NEAR(perimeter, 2 * (0.21 + 0.3), 10 * size + 1e-8) << trial;
    for (const Vector2d& p : corners) ASSERT_GE(SignedDistance(hull, p), -1e-8) << trial;
  }
}

// Soles of a standing robot: their corners along y are level to anything between rounding and a
// micrometre. Once they crossed a hull of ten corners, and a robot that stood still was pushed
// down.
TEST(ConvexHull, OfNearlyAlignedSolesCoversThemAndTurnsLeft) {
  std::mt19937_64 random(TestSeed(291));
  std::uniform_real_distribution<double> exponent(-18, -6), unit(-1, 1);
  double worst_support = 0, worst_area = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double noise = std::pow(10, exponent(random));
    const double half = trial % 2 == 0 ? 0.14 : 0.1 + 0.05 * unit(random);
    std::vector<Vector2d> points;
    for (const double side : {-0.105, 0.105}) {
      for (const double x : {-half, half}) {
        for (const double y : {-0.065, 0.065}) {
          points.push_back({x + noise * unit(random), side + y + noise * unit(random)});
        }
      }
    }
    std::shuffle(points.begin(), points.end(), random);
    const ConvexPolygon hull = ConvexHull(points);
    ASSERT_GE(hull.num_corners, 4);
    ASSERT_LE(hull.num_corners, 8);
    for (int i = 0; i < 36; ++i) {  // the hull reaches as far as the points, whichever way
      const Vector2d way(std::cos(i * M_PI / 18), std::sin(i * M_PI / 18));
      double of_points = -1, of_hull = -1;
      for (const Vector2d& point : points) of_points = std::max(of_points, way.dot(point));
      for (const Vector2d& corner : hull.corners()) of_hull = std::max(of_hull, way.dot(corner));
      worst_support = std::max(worst_support, std::abs(of_points - of_hull));
    }
    worst_area = std::max(worst_area, std::abs(Area(hull) - 2 * half * 0.34) - 4 * noise);
    EXPECT_GT(SignedDistance(hull, {0, 0}), 0.04) << trial;
  }
  // Two of a side's corners may be left out as on a line, 2 nm each; all are moved by half a grid.
  EXPECT_LT(worst_support, 2 * 2e-9 + 2 * 0.71e-9);
  EXPECT_LT(worst_area, 2e-9);
}

TEST(ConvexHull, OfASoleAheadOfTheOtherHasSixCorners) {
  std::vector<Vector2d> corners;
  for (const Vector2d& at : {Vector2d(0, -0.1), Vector2d(0.2, 0.1)}) {
    for (const double dx : {-0.15, 0.15}) {
      for (const double dy : {-0.075, 0.075}) corners.push_back(at + Vector2d(dx, dy));
    }
  }
  const ConvexPolygon hull = ConvexHull(corners);
  ASSERT_EQ(hull.num_corners, 6);
  // A rectangle swept along (0.2, 0.2).
  EXPECT_NEAR(Area(hull), 0.30 * 0.15 + 0.2 * 0.15 + 0.2 * 0.30, 1e-15);
}

TEST(ConvexHull, OfARegularPolygonIsItselfAndTurnsLeft) {
  std::vector<Vector2d> corners;
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * M_PI * ((7 * i) % 16) / 16;
    corners.push_back({std::cos(angle), std::sin(angle)});
  }
  const ConvexPolygon hull = ConvexHull(corners);
  ASSERT_EQ(hull.num_corners, 16);
  EXPECT_NEAR(Area(hull), 8 * std::sin(M_PI / 8), 1e-14);
}

TEST(ConvexHull, OfPointsOnALineIsASegmentAndOfEqualOnesAPoint) {
  const std::vector<Vector2d> line = {{0, 0}, {0.3, 0.1}, {0.6, 0.2}, {0.15, 0.05}};
  const ConvexPolygon segment = ConvexHull(line);
  ASSERT_EQ(segment.num_corners, 2);
  EXPECT_EQ(segment.corner[0], Vector2d(0, 0));
  EXPECT_EQ(segment.corner[1], Vector2d(0.6, 0.2));
  EXPECT_EQ(SignedDistance(segment, {0.3, 0.1}), 0);
  EXPECT_NEAR(SignedDistance(segment, {-0.3, -0.1}), -std::hypot(0.3, 0.1), 1e-15);

  const std::vector<Vector2d> same(5, Vector2d(1, 2));
  EXPECT_EQ(ConvexHull(same).num_corners, 1);
  EXPECT_EQ(NearestPoint(ConvexHull(same), {4, 6}), Vector2d(1, 2));
  EXPECT_EQ(SignedDistance(ConvexHull(same), {4, 6}), -5);
}

TEST(ConvexHull, OfNothingOrOfWhatIsNotFiniteIsEmpty) {
  EXPECT_EQ(ConvexHull({}).num_corners, 0);
  const std::vector<Vector2d> bad = {{0, 0}, {1, 0}, {0, NAN}};
  EXPECT_EQ(ConvexHull(bad).num_corners, 0);
  EXPECT_EQ(SignedDistance(ConvexPolygon{}, {0, 0}), -INFINITY);
}

// By definition: each point is a convex combination exactly when no line separates it; the corners
// are among the points, and every triangle of points lies inside.
TEST(ConvexHull, HoldsAllPointsAndNoMore) {
  std::mt19937 random(TestSeed(3));
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<Vector2d> points(static_cast<size_t>(3 + trial % 14));
    for (Vector2d& p : points) p = {uniform(random), uniform(random)};
    if (trial % 3 == 0) points.push_back(points.front());
    if (points.size() > 16) points.resize(16);
    const ConvexPolygon hull = ConvexHull(points);
    ASSERT_GE(hull.num_corners, 3);
    // To the grid of the hull's arithmetic.
    for (const Vector2d& p : points) EXPECT_GE(SignedDistance(hull, p), -1e-8);
    for (const Vector2d& c : hull.corners()) {
      EXPECT_TRUE(std::find(points.begin(), points.end(), c) != points.end());
      EXPECT_LE(std::abs(SignedDistance(hull, c)), 1e-12);
    }
    for (int i = 0; i < hull.num_corners; ++i) {
      const auto at = [&](int j) { return hull.corner[static_cast<size_t>(j % hull.num_corners)]; };
      const Vector2d in = at(i + 1) - at(i), out = at(i + 2) - at(i + 1);
      EXPECT_GT(in.x() * out.y() - in.y() * out.x(), 0);
    }
  }
}

TEST(NearestPoint, OfARectangleIsTheClampPerAxis) {
  const Vector2d half(0.13, 0.07);
  const ConvexPolygon rectangle = Rectangle(half);
  std::mt19937 random(TestSeed(5));
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  int inside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector2d point(uniform(random), uniform(random));
    const Vector2d clamped = point.cwiseMax(-half).cwiseMin(half);
    EXPECT_LT((NearestPoint(rectangle, point) - clamped).norm(), 1e-15);
    const double beyond = (point - clamped).norm();
    const double within = (half - point.cwiseAbs()).minCoeff();
    EXPECT_NEAR(SignedDistance(rectangle, point), beyond > 0 ? -beyond : within, 1e-15);
    inside += beyond > 0 ? 0 : 1;
    if (beyond == 0) {
      EXPECT_EQ(NearestPoint(rectangle, point), point);
    }
  }
  EXPECT_GT(inside, 50);
}

TEST(NearestPoint, BeatsEveryPointOfTheBoundary) {
  std::mt19937 random(TestSeed(7));
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vector2d> points(8);
    for (Vector2d& p : points) p = {uniform(random), uniform(random)};
    const ConvexPolygon hull = ConvexHull(points);
    const Vector2d outside = 3 * Vector2d(uniform(random), uniform(random));
    if (SignedDistance(hull, outside) >= 0) continue;
    const double distance = (NearestPoint(hull, outside) - outside).norm();
    EXPECT_NEAR(-SignedDistance(hull, outside), distance, 1e-15);
    double best = INFINITY;
    for (int i = 0; i < hull.num_corners; ++i) {
      const Vector2d& a = hull.corner[static_cast<size_t>(i)];
      const Vector2d& b = hull.corner[static_cast<size_t>((i + 1) % hull.num_corners)];
      for (int j = 0; j <= 1000; ++j) {
        best = std::min(best, (a + (b - a) * (j / 1000.0) - outside).norm());
      }
    }
    EXPECT_LE(distance, best + 1e-12);
    EXPECT_GE(distance, best - 3e-3);
  }
}

}  // namespace
}  // namespace poise::balance
