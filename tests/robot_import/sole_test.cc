// Soles of shapes whose lowest face is known.
#include "components/robot/sole.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "tests/robot_import/import_support.h"
#include "tests/test_seed.h"
#include "tools/robot/mesh_file.h"
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

/// A wedge whose lower face, 20 mm below the origin, is `face`, as STL in millimetres.
void WriteWedge(const std::filesystem::path& file, const std::vector<Vector2d>& face) {
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
}

// What import writes is what the robot's loader takes, whatever the foot's points are.
TEST(Sole, AnOutlineIsASoleAfterRounding) {
  std::mt19937 random(TestSeed(4));
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 300; ++i) {
    // Points near the edges of a rounded rectangle: most corners stand out by micrometres.
    std::vector<Vector2d> points;
    for (int k = 0; k < 400; ++k) {
      const double angle = std::numbers::pi * unit(random),
                   power = 0.2 + 0.8 * std::abs(unit(random));
      const double c = std::cos(angle), s = std::sin(angle);
      points.emplace_back(0.12 * std::copysign(std::pow(std::abs(c), power), c),
                          0.05 * std::copysign(std::pow(std::abs(s), power), s));
      if (k % 3 == 0) points.push_back(points.back() + 1e-6 * Vector2d(unit(random), unit(random)));
    }
    std::vector<Vector2d> outline = robot::SoleOutline(points, 12);
    for (Vector2d& p : outline) p = (1e6 * p).array().round() / 1e6;
    EXPECT_EQ(robot::SoleProblem(outline), "");
    EXPECT_LE(outline.size(), 12u);
    EXPECT_GT(Area(outline), 0.9 * Area(robot::SoleOutline(points, 400)));
  }
}

// A triangle's box has its middle on an edge: the frame's origin lies inside nevertheless.
TEST(Sole, OfATriangleHasItsOriginInside) {
  FootShape shape;
  shape.kind = Kind::kMesh;
  shape.points = {{0, 0, 0}, {0.2, 0, 0}, {0, 0.1, 0}, {0.05, 0.03, 0.1}};
  const FoundSole sole = FindSole(std::vector{shape}, kDown, kForward);
  EXPECT_EQ(robot::SoleProblem(sole.polygon), "");
  EXPECT_NEAR(Area(sole.polygon), 0.01, 1e-12);
}

TEST(Sole, OfAMesh) {
  const std::vector<Vector2d> face = {
      {-0.1, -0.04}, {0.08, -0.05}, {0.12, 0}, {0.08, 0.05}, {-0.1, 0.04}};
  const auto file = WriteMaker("mesh", "").parent_path() / "foot.stl";
  WriteWedge(file, face);
  std::string problem;
  FootShape shape;
  shape.kind = Kind::kMesh;
  for (const Vector3d& p : MeshPoints(file, &problem)) shape.points.push_back(1e-3 * p);
  ASSERT_EQ(problem, "");
  const FoundSole sole = FindSole(std::vector{shape}, kDown, kForward);
  ASSERT_EQ(sole.polygon.size(), 5u);
  EXPECT_NEAR(Area(sole.polygon), Area(face), 1e-8);
  EXPECT_TRUE(sole.frame.translation().isApprox(Vector3d(0.01, 0, -0.02), 1e-6));
  EXPECT_TRUE(MeshPoints(file.parent_path() / "none.stl", &problem).empty());
  EXPECT_NE(problem, "");
  std::ofstream(file) << "solid foot";
  EXPECT_TRUE(MeshPoints(file, &problem).empty());
  EXPECT_NE(problem, "");
}

// One mesh for both feet, mirrored by its scale, in a folder of its own.
TEST(Sole, OfAMeshThatOneFootMirrors) {
  const std::vector<Vector2d> face = {
      {-0.1, -0.03}, {0.08, -0.06}, {0.12, 0.01}, {0.08, 0.05}, {-0.1, 0.04}};
  std::string text = SimpleBiped();
  const std::string box = "<box size='0.24 0.1 0.02'/>";
  for (const char* scale : {"1e-3 1e-3 1e-3", "1e-3 -1e-3 1e-3"}) {  // left stands first
    const size_t at = text.find(box);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, box.size(),
                 std::string("<mesh filename='package://maker/foot.stl' scale='") + scale + "'/>");
  }
  ImportOptions options;
  options.file = WriteMaker("mirrored", text);
  const RobotImport without = ImportRobot(options);
  ASSERT_EQ(without.defects.size(), 1u);
  EXPECT_NE(without.defects[0].what.find("package://maker/foot.stl"), std::string::npos);
  EXPECT_NE(without.defects[0].done.find("--meshes"), std::string::npos);
  for (const Foot& foot : without.robot.foot()) EXPECT_TRUE(foot.guessed());
  const auto folder = options.file.parent_path() / "elsewhere";
  std::filesystem::create_directories(folder);
  WriteWedge(folder / "foot.stl", face);
  options.meshes = {folder};
  const RobotImport with = ImportRobot(options);
  EXPECT_EQ(with.defects.size(), 0u);
  std::array<std::vector<Vector2d>, 2> corners;  // right, left
  for (int f = 0; f < 2; ++f) {
    const Foot& foot = with.robot.foot(f);
    ASSERT_EQ(foot.vertex_size(), 5) << f;
    EXPECT_FALSE(foot.guessed()) << f;
    for (const SoleVertex& v : foot.vertex()) {
      corners[static_cast<size_t>(f)].emplace_back(v.x() + foot.sole().x(),
                                                   v.y() + foot.sole().y());
    }
  }
  const auto has = [&](size_t f, const Vector2d& p) {
    return std::ranges::any_of(corners[f],
                               [&](const Vector2d& q) { return (p - q).norm() < 1e-5; });
  };
  for (const Vector2d& p : face) {
    const Vector2d at(p.x() + 0.06, p.y());  // of the foot's <origin>
    EXPECT_TRUE(has(1, at)) << at.transpose();
    EXPECT_TRUE(has(0, {at.x(), -at.y()})) << at.transpose();
  }
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
