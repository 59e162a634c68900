// Soles of shapes whose lowest face is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/robot_import/import_support.h"
#include "tools/robot_import/mesh_points.h"
#include "tools/robot_import/sole_finder.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Kind = robot::SourceShape::Kind;

FootShape Shape(Kind kind, const Vector3d& at, const Vector3d& size) {
  FootShape shape{kind, Isometry3d(Eigen::Translation3d(at)), size, {}};
  return shape;
}

double Area(const std::vector<Vector2d>& p) {
  double area = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const Vector2d& a = p[i];
    const Vector2d& b = p[(i + 1) % p.size()];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

const Vector3d kDown(0, 0, -1), kForward(1, 0, 0);

TEST(Sole, OfABoxBelowOthers) {
  const std::vector<FootShape> shapes = {
      Shape(Kind::kCylinder, {0, 0, 0}, {0.05, 0.1, 0}),
      Shape(Kind::kBox, {0.03, 0.01, -0.09}, {0.2, 0.1, 0.02}),
  };
  const FoundSole sole = FindSole(shapes, kDown, kForward);
  ASSERT_EQ(sole.polygon.size(), 4u);
  EXPECT_NEAR(Area(sole.polygon), 0.02, 1e-12);  // counter-clockwise: positive
  EXPECT_TRUE(sole.frame.translation().isApprox(Vector3d(0.03, 0.01, -0.1), 1e-12));
  EXPECT_TRUE(sole.frame.linear().isIdentity(1e-12));
}

TEST(Sole, OfATurnedFootIsTheSame) {
  // The same foot in a body whose axes lie anyhow, set down within 0.2 rad of level.
  const Eigen::Matrix3d body =
      (Eigen::AngleAxisd(1.1, Vector3d(1, 2, 3).normalized()) * Eigen::AngleAxisd(0.4, kForward))
          .toRotationMatrix();
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = body;
  FootShape box = Shape(Kind::kBox, {0.03, 0.01, -0.09}, {0.2, 0.1, 0.02});
  box.pose = pose * box.pose;
  const Vector3d tilted = Eigen::AngleAxisd(0.2, Vector3d::UnitY()) * kDown;
  const FoundSole sole = FindSole(std::vector{box}, body * tilted, body * kForward);
  ASSERT_EQ(sole.polygon.size(), 4u);
  EXPECT_NEAR(Area(sole.polygon), 0.02, 1e-9);
  EXPECT_TRUE(sole.frame.translation().isApprox(body * Vector3d(0.03, 0.01, -0.1), 1e-9));
}

TEST(Sole, OfFourSpheresIsATrapezoid) {
  std::vector<FootShape> shapes;
  for (const Vector3d& at : {Vector3d(-0.05, 0.025, -0.03), Vector3d(-0.05, -0.025, -0.03),
                             Vector3d(0.12, 0.03, -0.03), Vector3d(0.12, -0.03, -0.03)}) {
    shapes.push_back(Shape(Kind::kSphere, at, {0.005, 0, 0}));
  }
  const FoundSole sole = FindSole(shapes, kDown, kForward);
  ASSERT_EQ(sole.polygon.size(), 4u);
  EXPECT_NEAR(Area(sole.polygon), 0.17 * 0.055, 1e-12);
  EXPECT_TRUE(sole.frame.translation().isApprox(Vector3d(0.035, 0, -0.035), 1e-12));
}

TEST(Sole, OfAnUprightCylinderIsItsRimAndOfALyingOneNone) {
  const FoundSole disc =
      FindSole(std::vector{Shape(Kind::kCylinder, {0, 0, 0}, {0.1, 0.04, 0})}, kDown, kForward);
  EXPECT_LE(disc.polygon.size(), 12u);
  // Within the disc, and most of it: a dodecagon has 3 r².
  EXPECT_LE(Area(disc.polygon), std::numbers::pi * 0.01);
  EXPECT_GE(Area(disc.polygon), 0.029);
  // The polygon's origin is the centre of its box: twelve points of 24 need not lie evenly.
  for (const Vector2d& p : disc.polygon) {
    const Vector3d at = disc.frame * Vector3d(p.x(), p.y(), 0);
    EXPECT_LE(at.head<2>().norm(), 0.1 + 1e-9);
    EXPECT_NEAR(at.z(), -0.02, 1e-12);
  }
  FootShape lying = Shape(Kind::kCapsule, {0, 0, 0}, {0.05, 0.2, 0});
  lying.pose.linear() =
      Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY()).toRotationMatrix();
  EXPECT_TRUE(FindSole(std::vector{lying}, kDown, kForward).polygon.empty());
}

TEST(Sole, OfAMesh) {
  // A wedge whose lower face is a pentagon.
  const std::vector<Vector2d> face = {
      {-0.1, -0.04}, {0.08, -0.05}, {0.12, 0}, {0.08, 0.05}, {-0.1, 0.04}};
  const auto file = WriteMaker("mesh", "").parent_path() / "foot.stl";
  std::ofstream stl(file);
  stl << "solid foot\n";
  const auto facet = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    stl << "facet normal 0 0 0\nouter loop\n";
    for (const Vector3d& p : {a, b, c}) stl << "vertex " << p.transpose() << "\n";
    stl << "endloop\nendfacet\n";
  };
  const Vector3d top(0, 0, 60);
  for (size_t i = 0; i < face.size(); ++i) {
    const Vector2d a = 1e3 * face[i], b = 1e3 * face[(i + 1) % face.size()];
    facet({a.x(), a.y(), -20}, {b.x(), b.y(), -20}, {0, 0, -20});
    facet({a.x(), a.y(), -20}, {b.x(), b.y(), -20}, top);
  }
  stl << "endsolid foot\n";
  stl.close();
  std::string problem;
  FootShape shape;
  shape.kind = Kind::kMesh;
  shape.points = MeshPoints(file, Vector3d(1e-3, -1e-3, 1e-3), &problem);  // millimetres, mirrored
  ASSERT_EQ(problem, "");
  const FoundSole sole = FindSole(std::vector{shape}, kDown, kForward);
  ASSERT_EQ(sole.polygon.size(), 5u);
  EXPECT_NEAR(Area(sole.polygon), Area(face), 1e-8);
  EXPECT_TRUE(sole.frame.translation().isApprox(Vector3d(0.01, 0, -0.02), 1e-6));
  EXPECT_TRUE(MeshPoints(file.parent_path() / "none.stl", Vector3d::Ones(), &problem).empty());
  EXPECT_NE(problem, "");
}

TEST(Sole, TheImportedBipedStandsOnItsBoxes) {
  const RobotImport imported = ImportText("soles", SimpleBiped());
  ASSERT_EQ(imported.robot.foot_size(), 2);
  for (const Foot& foot : imported.robot.foot()) {
    EXPECT_EQ(foot.link(), foot.name() + "_foot");
    EXPECT_NEAR(foot.length(), 0.24, 1e-9);
    EXPECT_NEAR(foot.width(), 0.1, 1e-9);
    EXPECT_NEAR(foot.sole().x(), 0.06, 1e-9);
    EXPECT_NEAR(foot.sole().z(), -0.08, 1e-9);
    EXPECT_FALSE(foot.force_sensor());
  }
}

}  // namespace
}  // namespace poise
