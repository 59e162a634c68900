// Soles of any convex shape: closed forms of triangle and hexagon, forces at the corners as oracle,
// and the rectangle as four corners.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "components/balance/distribution_ratio.h"
#include "components/balance/support_polygon.h"
#include "components/robot/sole.h"
#include "tests/test_seed.h"

namespace poise::balance {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

robot::FootModel Foot(std::vector<Vector2d> vertices) {
  robot::FootModel foot;
  foot.vertices = std::move(vertices);
  return foot;
}

/// Corners at the distance `radius` from the origin, the first on the x axis.
std::vector<Vector2d> Regular(int n, double radius) {
  std::vector<Vector2d> corners;
  for (int i = 0; i < n; ++i) {
    corners.emplace_back(radius * std::cos(2 * pi * i / n), radius * std::sin(2 * pi * i / n));
  }
  return corners;
}

/// Hull of `n` random points of a sole's size around the origin.
std::vector<Vector2d> RandomSole(int n, std::mt19937* random) {
  std::uniform_real_distribution<double> x(-0.15, 0.15), y(-0.08, 0.08);
  while (true) {
    std::vector<Vector2d> points;
    for (int i = 0; i < n; ++i) points.emplace_back(x(*random), y(*random));
    const ConvexPolygon hull = ConvexHull(points);
    const std::vector<Vector2d> corners(hull.corners().begin(), hull.corners().end());
    if (robot::SoleProblem(corners).empty()) return corners;
  }
}

/// m that `at` is inside the hull of any number of points: least distance from an edge's line, of
/// the edges that Jarvis' march finds.
double Inside(const std::vector<Vector2d>& points, const Vector2d& at) {
  const auto left_most = [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x(); };
  const Vector2d start = *std::min_element(points.begin(), points.end(), left_most);
  double least = HUGE_VAL;
  Vector2d corner = start;
  do {
    Vector2d next = corner == points[0] ? points[1] : points[0];
    for (const Vector2d& point : points) {
      const Vector2d way = next - corner, other = point - corner;
      if (way.x() * other.y() - way.y() * other.x() < 0) next = point;
    }
    const Vector2d way = (next - corner).normalized(), to = at - corner;
    least = std::min(least, way.x() * to.y() - way.y() * to.x());
    corner = next;
  } while (corner != start);
  return least;
}

ContactLimits Limits(const robot::FootModel& foot, double margin = 0) {
  ContactLimits limits;
  limits.edges = EdgesOf(SolePolygon(foot, margin));
  return limits;
}

/// The wrench of a load of 1 N·`load` at the centre of pressure `cop`.
Vector6d Pressed(const Vector2d& cop, double load) {
  Vector6d wrench = Vector6d::Zero();
  wrench(2) = -load;
  wrench(3) = -load * cop.y();
  wrench(4) = load * cop.x();
  return wrench;
}

TEST(PolygonSole, DistancesInTriangleAndHexagonAreThoseOfGeometry) {
  const double r = 0.1;
  EXPECT_NEAR(robot::InnerRadius(Foot(Regular(3, r))), r / 2, 1e-15);
  EXPECT_NEAR(robot::InnerRadius(Foot(Regular(6, r))), r * std::sqrt(3) / 2, 1e-15);
  EXPECT_NEAR(robot::DistanceInside(Foot(Regular(3, r)), {-r, 0}), -r / 2, 1e-15);
  robot::FootModel rectangle;
  rectangle.length = 0.3;
  rectangle.width = 0.15;
  EXPECT_EQ(robot::InnerRadius(rectangle), 0.075);
  EXPECT_NEAR(robot::DistanceInside(rectangle, {-0.13, 0.01}), 0.02, 1e-15);
}

TEST(PolygonSole, MarginLeavesTheSmallerTriangleAndHexagon) {
  const double r = 0.1, margin = 0.02;
  for (const int n : {3, 6}) {
    const ConvexPolygon rest = SolePolygon(Foot(Regular(n, r)), margin);
    const double left = r - margin / std::cos(pi / n);
    ASSERT_EQ(rest.num_corners, n);
    for (const Vector2d& corner : Regular(n, left)) {
      EXPECT_LT((NearestPoint(rest, corner) - corner).norm(), 1e-12);
      EXPECT_NEAR(SignedDistance(rest, corner), 0, 1e-12);
    }
  }
  EXPECT_EQ(SolePolygon(Foot(Regular(3, r)), 0.51 * r).num_corners, 0);
}

TEST(PolygonSole, MarginCutsShortEdgesAway) {
  // A square with one corner cut off by 5 mm: a margin of 20 mm is past the short edge.
  const ConvexPolygon rest =
      SolePolygon(Foot({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.095}, {0.095, 0.1}, {-0.1, 0.1}}), 0.02);
  ASSERT_EQ(rest.num_corners, 4);
  EXPECT_NEAR(SignedDistance(rest, {0.08, 0.08}), 0, 1e-12);
}

TEST(PolygonSole, UnequalMarginsLeaveWhatAnEllipseFitsAbout) {
  std::mt19937 random(TestSeed(27));
  std::uniform_real_distribution<double> x(-0.15, 0.15), y(-0.08, 0.08);
  const Vector2d margin(0.012, 0.004);
  int inside = 0, outside = 0;
  for (int n = 0; n < 40; ++n) {
    const robot::FootModel foot = Foot(RandomSole(7, &random));
    const ConvexPolygon sole = SolePolygon(foot, 0);
    const ConvexPolygon rest = SolePolygon(foot, margin.x(), margin.y());
    for (int i = 0; i < 50; ++i) {
      const Vector2d at(x(random), y(random));
      double least = 1;
      for (int k = 0; k < 720; ++k) {
        const double angle = pi * k / 360;
        const Vector2d by(margin.x() * std::cos(angle), margin.y() * std::sin(angle));
        least = std::min(least, SignedDistance(sole, at + by));
      }
      if (std::abs(least) < 1e-6) continue;  // on the edge, as far as 720 points tell
      EXPECT_EQ(rest.num_corners > 0 && SignedDistance(rest, at) > 0, least > 0);
      ++(least > 0 ? inside : outside);
    }
  }
  EXPECT_GT(inside, 200);
  EXPECT_GT(outside, 200);
  robot::FootModel rectangle;
  rectangle.length = 0.3;
  rectangle.width = 0.15;
  EXPECT_NEAR(SignedDistance(SolePolygon(rectangle, 0.01, 0.005), {0.14, 0}), 0, 1e-15);
  EXPECT_NEAR(SignedDistance(SolePolygon(rectangle, 0.01, 0.005), {0, -0.07}), 0, 1e-15);
}

TEST(PolygonSole, LargestRectangleOfDiamondAndHexagon) {
  const auto largest = [](const std::vector<Vector2d>& corners, const Vector2d& given) {
    return LargestRectangle(EdgesOf(ConvexHull(corners)), given);
  };
  const std::vector<Vector2d> diamond{{0.2, 0}, {0, 0.1}, {-0.2, 0}, {0, -0.1}};
  const Vector2d half = largest(diamond, Vector2d::Zero());
  EXPECT_NEAR(half.x(), 0.1, 1e-7);
  EXPECT_NEAR(half.y(), 0.05, 1e-7);
  EXPECT_LT((largest(diamond, {0.15, 0}) - Vector2d(0.15, 0.025)).norm(), 1e-12);
  EXPECT_LT((largest(diamond, {0, 0.08}) - Vector2d(0.04, 0.08)).norm(), 1e-12);
  // In a regular hexagon it reaches from edge to edge and half of its corners' way out.
  const Vector2d hexagon = largest(Regular(6, 0.1), Vector2d::Zero());
  EXPECT_NEAR(hexagon.x(), 0.05, 1e-7);
  EXPECT_NEAR(hexagon.y(), 0.05 * std::sqrt(3), 1e-7);
}

TEST(PolygonSole, FewerCornersStayInsideAndCostTheLeast) {
  const ConvexPolygon all = ConvexHull(Regular(32, 0.1));
  ASSERT_EQ(all.num_corners, 32);
  const ConvexPolygon some = WithFewerCorners(all, 16);
  ASSERT_EQ(some.num_corners, 16);
  for (const Vector2d& corner : some.corners()) EXPECT_GE(SignedDistance(all, corner), -1e-12);
  // What is lost at most, were two neighbours never to go: the height of one corner.
  for (const Vector2d& corner : all.corners()) {
    EXPECT_GE(SignedDistance(some, corner), -0.1 * (1 - std::cos(2 * pi / 16)));
  }
}

/// Forces at three corners, pressing only, that have the wrench's F_z, M_x and M_y. A force inside
/// a convex polygon is the sum of such at three of its corners (Carathéodory).
bool CornersCanPress(const std::vector<Vector2d>& corners, const Vector6d& wrench) {
  for (size_t i = 0; i < corners.size(); ++i) {
    for (size_t j = i + 1; j < corners.size(); ++j) {
      for (size_t k = j + 1; k < corners.size(); ++k) {
        Eigen::Matrix3d map;
        int column = 0;
        for (const size_t c : {i, j, k}) {
          map.col(column++) = Eigen::Vector3d(-1, -corners[c].y(), corners[c].x());
        }
        const Eigen::Vector3d press = map.inverse() * wrench.segment<3>(2);
        if (press.allFinite() && press.minCoeff() >= 0) return true;
      }
    }
  }
  return false;
}

TEST(PolygonSole, ConditionsHoldExactlyWhereCornersCanPress) {
  std::mt19937 random{TestSeed(61)};
  std::uniform_real_distribution<double> x(-0.18, 0.18), y(-0.1, 0.1);
  int inside = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const std::vector<Vector2d> corners = RandomSole(3 + trial % 14, &random);
    const ContactLimits limits = Limits(Foot(corners));
    for (int i = 0; i < 20; ++i) {
      const Vector2d cop(x(random), y(random));
      const Vector6d wrench = Pressed(cop, 300);
      const ContactMargins margins = CheckContact(wrench, limits);
      EXPECT_EQ(margins.roll, margins.pitch);
      if (std::abs(margins.roll) < 1e-9) continue;  // on the edge either may be
      EXPECT_EQ(margins.Met(0), CornersCanPress(corners, wrench)) << cop.transpose();
      // The margin is the load times the distance to the nearest edge's line.
      EXPECT_NEAR(margins.roll, 300 * robot::DistanceInside(Foot(corners), cop), 1e-9);
      inside += margins.Met(0);
    }
  }
  EXPECT_GT(inside, 500);
}

struct Stand {
  std::array<Eigen::Isometry3d, 2> foot;
  Vector6d resultant;
};

/// Soles some tenths of a radian from parallel, and a resultant that presses somewhere near them.
Stand RandomStand(std::mt19937* random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Stand stand;
  for (size_t i = 0; i < 2; ++i) {
    const Eigen::Vector3d turn(0.1 * unit(*random), 0.1 * unit(*random), 0.3 * unit(*random));
    stand.foot[i] = Eigen::Translation3d(0.05 * unit(*random), i == 0 ? -0.1 : 0.1, 0) *
                    Eigen::AngleAxisd(turn.norm(), turn.normalized());
  }
  stand.resultant = Pressed({0.12 * unit(*random), 0.18 * unit(*random)}, 500);
  stand.resultant(0) = 60 * unit(*random);
  stand.resultant(1) = 60 * unit(*random);
  stand.resultant(5) = 20 * unit(*random);
  return stand;
}

TEST(PolygonSole, RectangleAsFourCornersIsTheRectangle) {
  std::mt19937 random{TestSeed(62)};
  const Vector2d half(0.14, 0.07);
  ContactLimits rectangle;
  rectangle.half_length = half.x();
  rectangle.half_width = half.y();
  const ContactLimits corners =
      Limits(Foot({{-0.14, -0.07}, {0.14, -0.07}, {0.14, 0.07}, {-0.14, 0.07}}));
  int feasible = 0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    const Stand stand = RandomStand(&random);
    const ContactMargins a = CheckContact(stand.resultant, rectangle),
                         b = CheckContact(stand.resultant, corners);
    EXPECT_NEAR(std::min(a.roll, a.pitch), b.roll, 1e-10);
    const RatioInterval one = FeasibleRatio(stand.resultant, stand.foot, rectangle, 0.02, 0.98),
                        other = FeasibleRatio(stand.resultant, stand.foot, corners, 0.02, 0.98);
    ASSERT_EQ(one.feasible, other.feasible);
    EXPECT_NEAR(one.min, other.min, 1e-12);
    EXPECT_NEAR(one.max, other.max, 1e-12);
    EXPECT_NEAR(SelectRatio(one, stand.resultant, stand.foot, rectangle, 0.02, 0.98),
                SelectRatio(other, stand.resultant, stand.foot, corners, 0.02, 0.98), 1e-12);
    feasible += one.feasible;
  }
  EXPECT_GT(feasible, kTrials / 10);
  EXPECT_LT(feasible, kTrials * 9 / 10);
}

/// m, that the worse foot's centre of pressure lacks of its sole, weighted as the conditions are:
/// N·m per unit of load share.
double Lack(const Stand& stand, const std::array<std::vector<Vector2d>, 2>& corners, double eta) {
  const FootArray<Vector6d> share = DistributeResultant(stand.resultant, stand.foot, eta);
  double worst = -HUGE_VAL;
  for (size_t i = 0; i < 2; ++i) {
    const double part = i == 0 ? eta : 1 - eta;
    const double inside =
        robot::DistanceInside(Foot(corners[i]), CenterOfPressure(share[i])) * -share[i](2) / part;
    worst = std::max(worst, -inside);
    worst = std::max(worst, (std::abs(share[i](5)) + 0.9 * share[i](2)) / part);
  }
  return worst;
}

// Different soles on the two feet, so that neither one's conditions stand for the other's.
TEST(PolygonSole, RatiosAreThoseThatASearchFinds) {
  std::mt19937 random{TestSeed(63)};
  int feasible = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Stand stand = RandomStand(&random);
    const std::array<std::vector<Vector2d>, 2> corners{RandomSole(5 + trial % 8, &random),
                                                       RandomSole(4 + trial % 12, &random)};
    const SoleLimits limits{Limits(Foot(corners[0])), Limits(Foot(corners[1]))};
    const RatioInterval interval = FeasibleRatio(stand.resultant, stand.foot, limits, 0.02, 0.98);
    double least = HUGE_VAL, first = 2, last = -1;
    constexpr int kSteps = 960;
    for (int i = 0; i <= kSteps; ++i) {
      const double eta = 0.02 + 0.96 * i / kSteps, lack = Lack(stand, corners, eta);
      least = std::min(least, lack);
      if (lack >= 0) continue;
      first = std::min(first, eta);
      last = std::max(last, eta);
    }
    if (least < -0.5) {
      ASSERT_TRUE(interval.feasible) << interval.limiting_condition;
      EXPECT_NEAR(interval.min, first, 1.1e-3);
      EXPECT_NEAR(interval.max, last, 1.1e-3);
      ++feasible;
    } else if (least > 0) {
      ASSERT_FALSE(interval.feasible && least > 0.5);
      const double eta = SelectRatio(interval, stand.resultant, stand.foot, limits, 0.02, 0.98);
      // To a millimetre of centre of pressure the least.
      EXPECT_LE(Lack(stand, corners, eta), least + 1e-3 * stand.resultant.head<3>().norm() + 1e-9);
    }
  }
  EXPECT_GT(feasible, 20);
}

TEST(PolygonSole, CornersAreThoseOfTheEdges) {
  std::mt19937 random{TestSeed(64)};
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<Vector2d> corners = RandomSole(3 + trial % 14, &random);
    const ConvexPolygon sole = ConvexHull(corners), again = CornersOf(EdgesOf(sole));
    ASSERT_EQ(again.num_corners, sole.num_corners);
    for (size_t i = 0; i < corners.size(); ++i) {
      EXPECT_LT((again.corner[i] - sole.corner[i]).norm(), 1e-9);
    }
  }
  EXPECT_EQ(CornersOf(HalfPlanes{}).num_corners, 0);
}

Vector6d Sum(const std::array<Vector6d, 2>& share, const std::array<Eigen::Isometry3d, 2>& foot) {
  const Eigen::Isometry3d o = Eigen::Isometry3d::Identity();
  return WrenchTransform(o, foot[0]) * share[0] + WrenchTransform(o, foot[1]) * share[1];
}

// Level parallel feet with soles of their own shapes: with a share η the common centre of pressure
// can be what the sum of the polygons η S_r + (1 − η) S_l has, and nothing else.
TEST(PolygonSole, SharesAreMovedIntoSolesWhereTheSumOfSolesHasThem) {
  std::mt19937 random{TestSeed(65)};
  std::uniform_real_distribution<double> x(-0.18, 0.18), y(-0.12, 0.12), ratio(0.02, 0.98);
  int moved = 0, beyond = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::array<ConvexPolygon, 2> sole{ConvexHull(RandomSole(5 + trial % 8, &random)),
                                            ConvexHull(RandomSole(4 + trial % 5, &random))};
    const double eta = ratio(random);
    std::vector<Vector2d> sums;
    for (const Vector2d& a : sole[0].corners()) {
      for (const Vector2d& b : sole[1].corners()) sums.push_back(eta * a + (1 - eta) * b);
    }
    const Vector2d cop(x(random), y(random));
    const double room = Inside(sums, cop);
    std::array<Eigen::Isometry3d, 2> foot{Eigen::Isometry3d::Identity(),
                                          Eigen::Isometry3d::Identity()};
    foot[0].translation() << 0.03, -0.1, 0;
    foot[1].translation() << -0.02, 0.11, 0;
    FootArray<Vector6d> share{Pressed(cop, 500 * eta), Pressed(cop, 500 * (1 - eta))};
    const Vector6d before = Sum(share, foot);
    MoveIntoSoles(foot, sole, &share);
    EXPECT_LT((Sum(share, foot) - before).norm(), 1e-9);
    const double inside = std::min(SignedDistance(sole[0], CenterOfPressure(share[0])),
                                   SignedDistance(sole[1], CenterOfPressure(share[1])));
    const bool both = Contains(sole[0], cop) && Contains(sole[1], cop);
    if (both) {
      EXPECT_EQ((share[0] - Pressed(cop, 500 * eta)).norm(), 0);
    } else if (room > 1e-4) {
      EXPECT_GT(inside, -1e-9) << "room " << room << ", eta " << eta;
      ++moved;
    } else if (room < -1e-4) {
      EXPECT_LT(inside, 0);
      ++beyond;
    }
  }
  EXPECT_GT(moved, 100);
  EXPECT_GT(beyond, 300);
}

// Every point of the hull of mirrored soles, less what a foot of 2 % load draws it inwards, can be
// had, though each foot must then have a centre of pressure of its own.
TEST(PolygonSole, MirroredSolesCanDoWhatTheirHullPromises) {
  std::mt19937 random{TestSeed(66)};
  std::uniform_real_distribution<double> unit(-1, 1);
  const double apart = 0.2, margin = 0.003;
  int needed = 0, tried = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    std::vector<Vector2d> left, right;
    do {
      left = RandomSole(6 + trial % 8, &random);
    } while (robot::InnerRadius(Foot(left)) < 0.025);
    for (auto corner = left.rbegin(); corner != left.rend(); ++corner) {
      right.emplace_back(corner->x(), -corner->y());
    }
    Stand stand;
    stand.foot = {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
    stand.foot[0].translation().y() = -apart / 2;
    stand.foot[1].translation().y() = apart / 2;
    ContactGeometry geometry;
    geometry.sole = stand.foot;
    const double hull_margin = margin + 0.025 * (apart + 0.16);
    const ConvexPolygon hull = SupportPolygon(
        Eigen::Isometry3d::Identity(), geometry,
        {SolePolygon(Foot(right), hull_margin), SolePolygon(Foot(left), hull_margin)});
    const Vector2d cop = NearestPoint(hull, {0.2 * unit(random), 0.25 * unit(random)});
    stand.resultant = Pressed(cop, 500);
    const SoleLimits limits{Limits(Foot(right), margin), Limits(Foot(left), margin)};
    const std::array<ConvexPolygon, 2> sole{CornersOf(limits[0].edges), CornersOf(limits[1].edges)};
    const RatioInterval interval = FreeRatio(stand.resultant, stand.foot, limits, sole, 0.02, 0.98);
    ASSERT_TRUE(interval.feasible) << interval.limiting_condition;
    const double eta = SelectRatio(interval, stand.resultant, stand.foot, limits, 0.02, 0.98);
    FootArray<Vector6d> share = DistributeResultant(stand.resultant, stand.foot, eta);
    ++tried;
    needed += !FeasibleRatio(stand.resultant, stand.foot, limits, 0.02, 0.98).feasible;
    MoveIntoSoles(stand.foot, sole, &share);
    for (size_t i = 0; i < 2; ++i) {
      const double inside =
          robot::DistanceInside(Foot(i == 0 ? right : left), CenterOfPressure(share[i])) - margin;
      EXPECT_GT(inside, -1e-9) << "foot " << i << ", eta " << eta << ", cop " << cop.transpose();
    }
  }
  EXPECT_GT(needed, tried / 20);
}

// At the ends of the interval, where MoveIntoSoles has the least room: narrow soles turned by some
// degrees and tilted by one, as they are while a foot that has landed is loaded.
TEST(PolygonSole, TiltedSolesHoldTheirCentresOfPressureAtTheEndsOfTheInterval) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::vector<Vector2d> corners{
      {-0.085, -0.025}, {0.085, -0.03}, {0.085, 0.03}, {-0.085, 0.025}};
  const SoleLimits limits{Limits(Foot(corners), 0.0015), Limits(Foot(corners), 0.0015)};
  const std::array<ConvexPolygon, 2> sole{CornersOf(limits[0].edges), CornersOf(limits[1].edges)};
  int tried = 0, moved = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Stand stand;
    for (size_t i = 0; i < 2; ++i) {
      stand.foot[i] = Eigen::Translation3d(0.2 * unit(random), i == 0 ? -0.14 : 0.14, 0) *
                      Eigen::AngleAxisd(0.2 * unit(random), Eigen::Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(0.02 * unit(random), Eigen::Vector3d::UnitX()) *
                      Eigen::AngleAxisd(0.02 * unit(random), Eigen::Vector3d::UnitY());
    }
    stand.resultant = Pressed({0.25 * unit(random), 0.17 * unit(random)}, 320);
    stand.resultant.head<2>() = 30 * Vector2d(unit(random), unit(random));
    const RatioInterval interval = FreeRatio(stand.resultant, stand.foot, limits, sole, 0, 1);
    if (!interval.feasible || interval.max - interval.min < 0.01) continue;
    ++tried;
    for (const double eta : {interval.min, interval.max}) {
      FootArray<Vector6d> share = DistributeResultant(stand.resultant, stand.foot, eta);
      moved += !(robot::DistanceInside(Foot(corners), CenterOfPressure(share[0])) > 0.0015);
      MoveIntoSoles(stand.foot, sole, &share);
      for (size_t i = 0; i < 2; ++i) {
        if (!(share[i][2] < -1)) continue;  // of a foot that carries nothing there is none
        const double inside =
            robot::DistanceInside(Foot(corners), CenterOfPressure(share[i])) - 0.0015;
        EXPECT_GT(inside, -1e-6) << "foot " << i << ", eta " << eta << ", trial " << trial;
      }
    }
  }
  EXPECT_GT(tried, 300);
  EXPECT_GT(moved, 100);
}

TEST(PolygonSole, RefusesWhatIsNoSole) {
  const auto says = [](const std::vector<Vector2d>& corners, const std::string& what) {
    const std::string problem = robot::SoleProblem(corners);
    EXPECT_NE(problem.find(what), std::string::npos) << problem;
  };
  std::vector<Vector2d> hexagon = Regular(6, 0.1);
  EXPECT_EQ(robot::SoleProblem(hexagon), "");
  EXPECT_EQ(robot::SoleProblem(Regular(16, 0.1)), "");
  says(Regular(17, 0.1), "at most 16");
  says({{0, 0}, {1, 0}}, "at least 3");
  says({hexagon.rbegin(), hexagon.rend()}, "clockwise");
  std::vector<Vector2d> dented = hexagon;
  dented[2] *= 0.4;
  says(dented, "[2]");
  std::vector<Vector2d> straight = hexagon;
  straight.insert(straight.begin() + 1, 0.5 * (hexagon[0] + hexagon[1]));
  says(straight, "[1]");
  std::vector<Vector2d> twice = hexagon;
  twice.insert(twice.begin(), hexagon[0]);
  says(twice, "no corner");
  std::vector<Vector2d> beside = hexagon;
  for (Vector2d& corner : beside) corner.x() += 0.2;
  says(beside, "origin inside");
  std::vector<Vector2d> star;
  for (int i = 0; i < 5; ++i) star.push_back(Regular(5, 0.1)[static_cast<size_t>(2 * i % 5)]);
  says(star, "more than once");
  hexagon[3].y() = NAN;
  says(hexagon, "[3] is not finite");
}

}  // namespace
}  // namespace poise::balance
