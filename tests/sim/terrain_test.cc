#include "sim/terrain.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"

namespace poise {
namespace {

Terrain Make(const std::string& text, uint64_t seed = 1) {
  SimConfig config;
  ParseTextProto(text, "test", &config);
  CheckFields(config);
  return Terrain(config, seed);
}

TEST(Terrain, GroundIsLevel) {
  const Terrain::Surface surface = Make("").At(3, -2, 0);
  EXPECT_EQ(surface.height, 0);
  EXPECT_EQ(surface.normal, Eigen::Vector3d::UnitZ());
  EXPECT_FALSE(surface.block);
}

TEST(Terrain, BlockCoversItsRectangleFromItsStart) {
  const Terrain terrain =
      Make("block { x: 1 y: 0.5 length: 0.4 width: 0.2 height: 0.09 start: 2 }");
  EXPECT_FALSE(terrain.At(1, 0.5, 1.999).block);
  EXPECT_TRUE(terrain.At(1, 0.5, 2).block);
  EXPECT_EQ(terrain.At(1.19, 0.59, 2).height, 0.09);
  EXPECT_EQ(terrain.At(1.21, 0.5, 2).height, 0);
  EXPECT_EQ(terrain.At(1, 0.61, 2).height, 0);
}

TEST(Terrain, BlockRisesFromTheGround) {
  const Terrain terrain = Make("block { height: 0.08 start: 2 rise: 1 }");
  EXPECT_EQ(terrain.At(0, 0, 2).height, 0);
  EXPECT_NEAR(terrain.At(0, 0, 2.5).height, 0.04, 1e-12);  // minimum jerk is symmetric
  EXPECT_NEAR(terrain.At(0, 0, 2.2).height + terrain.At(0, 0, 2.8).height, 0.08, 1e-12);
  EXPECT_EQ(terrain.At(0, 0, 3).height, 0.08);
  EXPECT_EQ(terrain.At(0, 0, 9).height, 0.08);
  const double h = 1e-6;
  EXPECT_NEAR(terrain.At(0, 0, 2.3).velocity,
              (terrain.At(0, 0, 2.3 + h).height - terrain.At(0, 0, 2.3 - h).height) / (2 * h),
              1e-6);
  EXPECT_EQ(terrain.At(0, 0, 9).velocity, 0);
}

TEST(Terrain, ReliefRisesWithTheBlock) {
  const std::string text = "length: 1 height: 0.08 tilt_pitch: 0.1 irregularity: 0.01 start: 2";
  const Terrain done = Make("block { " + text + " }");
  const Terrain rising = Make("block { " + text + " rise: 1 }");
  EXPECT_EQ(rising.At(-0.3, 0.05, 2).height, 0);
  EXPECT_NEAR(rising.At(-0.3, 0.05, 2.5).height, 0.5 * done.At(-0.3, 0.05, 2.5).height, 1e-12);
}

TEST(Terrain, SpringAndDamperOfAWholeSoleAreSharedByFourCorners) {
  const ContactMaterial material =
      Make("block { stiffness: 18000 damping: 300 friction: 0.7 }").material(true, 4);
  EXPECT_EQ(material.stiffness, 18000 / 4.0);
  EXPECT_EQ(material.damping, 300 / 4.0);
  EXPECT_EQ(material.friction, 0.7);
  EXPECT_EQ(Make("ground { friction: 0.4 }").material(false, 4).friction, 0.4);
  EXPECT_EQ(Make("").material(false, 4).stiffness, 0) << "rigid";
}

TEST(Terrain, TiltTurnsTheNormal) {
  const Terrain terrain = Make("block { height: 0.3 tilt_roll: 0.1 tilt_pitch: -0.2 }");
  const Eigen::Matrix3d r = (Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  EXPECT_LT((terrain.At(0, 0, 0).normal - r.col(2)).norm(), 1e-15);
  // Points of the top, taken along its own axes.
  for (const double u : {-0.1, 0.12}) {
    const Eigen::Vector3d p = r * Eigen::Vector3d(u, -0.7 * u, 0);
    EXPECT_NEAR(terrain.At(p.x(), p.y(), 0).height, 0.3 + p.z(), 1e-15);
  }
}

TEST(Terrain, IrregularityIsSeededBoundedAndSmooth) {
  const std::string text = "block { height: 0.3 tilt_roll: 0.05 irregularity: 0.01 }";
  const Terrain terrain = Make(text, 7), same = Make(text, 7), other = Make(text, 8);
  const Terrain flat = Make("block { height: 0.3 tilt_roll: 0.05 }");
  double largest = 0, difference = 0;
  for (double x = -0.19; x < 0.19; x += 0.01) {
    for (double y = -0.14; y < 0.14; y += 0.01) {
      const Terrain::Surface surface = terrain.At(x, y, 0);
      EXPECT_EQ(surface.height, same.At(x, y, 0).height);
      largest = std::max(largest, std::abs(surface.height - flat.At(x, y, 0).height));
      difference = std::max(difference, std::abs(surface.height - other.At(x, y, 0).height));
      const double e = 1e-6;
      const double dx = (terrain.At(x + e, y, 0).height - terrain.At(x - e, y, 0).height) / (2 * e);
      const double dy = (terrain.At(x, y + e, 0).height - terrain.At(x, y - e, 0).height) / (2 * e);
      const Eigen::Vector3d normal = Eigen::Vector3d(-dx, -dy, 1).normalized();
      EXPECT_LT((surface.normal - normal).norm(), 1e-7);
    }
  }
  EXPECT_LE(largest, 0.01);
  EXPECT_GT(largest, 0.003);
  EXPECT_GT(difference, 0.003);
}

TEST(Terrain, AFieldsBlocksLieInTwoLanesWithinTheirBounds) {
  const std::string text =
      "start: 1 rows: 3 length: 0.4 stagger: 0.2 height: 0.05 tilt: 0.1 "
      "least_stiffness: 3000 most_stiffness: 90000";
  const Terrain terrain = Make("block_field { " + text + " }");
  EXPECT_FALSE(terrain.At(0.99, -0.1, 0).block);
  EXPECT_FALSE(terrain.At(1.19, 0.1, 0).block) << "the left lane begins later";
  EXPECT_FALSE(terrain.At(2.21, -0.1, 0).block);
  EXPECT_TRUE(terrain.At(2.39, 0.1, 0).block);
  std::set<int> seen;
  std::set<double> heights;
  for (int row = 0; row < 3; ++row) {
    for (const double side : {-1.0, 1.0}) {
      const double x = 1.2 + 0.4 * row + (side > 0 ? 0.2 : 0);
      const Terrain::Surface surface = terrain.At(x, 0.1 * side, 0);
      ASSERT_TRUE(surface.block);
      seen.insert(surface.field);
      heights.insert(surface.height);
      EXPECT_LE(std::abs(surface.height), 0.05);
      EXPECT_NEAR(surface.normal.norm(), 1, 1e-12);
      EXPECT_GE(surface.normal.z(), std::cos(0.1) * std::cos(0.1) - 1e-12);
      // The normal is that of the plane whose heights are given.
      const double h = 1e-3;
      const double along = (terrain.At(x + h, 0.1 * side, 0).height - surface.height) / h;
      const double across = (terrain.At(x, 0.1 * side + h, 0).height - surface.height) / h;
      EXPECT_NEAR(surface.normal.x(), -along * surface.normal.z(), 1e-9);
      EXPECT_NEAR(surface.normal.y(), -across * surface.normal.z(), 1e-9);
      const ContactMaterial material = terrain.material(surface, 4);
      EXPECT_GE(4 * material.stiffness, 3000);
      EXPECT_LE(4 * material.stiffness, 90000);
    }
  }
  EXPECT_EQ(seen.size(), 6u);
  EXPECT_EQ(heights.size(), 6u);
  const Terrain again = Make("block_field { " + text + " }"),
                other = Make("block_field { " + text + " }", 2);
  EXPECT_EQ(again.At(1.2, -0.1, 0).height, terrain.At(1.2, -0.1, 0).height);
  EXPECT_NE(other.At(1.2, -0.1, 0).height, terrain.At(1.2, -0.1, 0).height);
}

TEST(Terrain, AFieldClimbsByHalfAStairALane) {
  const Terrain terrain = Make("block_field { start: 1 height: 0 tilt: 0 climb: 0.2 rows: 4 }");
  EXPECT_NEAR(terrain.At(1.2, -0.1, 0).height, 0, 1e-12);
  EXPECT_NEAR(terrain.At(1.4, 0.1, 0).height, 0.1, 1e-12);
  EXPECT_NEAR(terrain.At(1.6, -0.1, 0).height, 0.2, 1e-12);
  EXPECT_NEAR(terrain.At(1.8, 0.1, 0).height, 0.3, 1e-12);
}

TEST(Terrain, AFieldThatCannotBeIsRefused) {
  EXPECT_THROW(Make("block_field { rows: 0 }"), ConfigError);
  EXPECT_THROW(Make("block_field { tilt: 2 }"), ConfigError);
  EXPECT_THROW(Make("block_field { least_stiffness: 2e5 most_stiffness: 1e3 }"), ConfigError);
}

}  // namespace
}  // namespace poise
