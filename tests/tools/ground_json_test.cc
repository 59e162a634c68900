// The blocks that a page draws beside the ground that feet meet.
#include "tools/report/ground_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "google/protobuf/text_format.h"
#include "sim/terrain.h"

namespace poise {
namespace {

SimConfig Config(const std::string& text) {
  SimConfig config;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &config));
  return config;
}

TEST(GroundJson, TheTopsAreThoseThatASoleMeets) {
  const SimConfig config = Config(
      "block_field { start: 0.4 rows: 10 stagger: 0.2 length: 0.4 height: 0.05 tilt: 0.17 "
      "least_stiffness: 5000 most_stiffness: 200000 }");
  const Terrain terrain(config, 300700);
  const nlohmann::ordered_json blocks = GroundJson(config, 300700);
  ASSERT_EQ(blocks.size(), 20u);
  double left = 0;
  for (const auto& block : blocks) {
    const std::vector<double> x = block["x"], y = block["y"], top = block["top"];
    EXPECT_NEAR(x[1] - x[0], 0.4, 1e-12);
    left += y[0] >= 0 ? 1 : 0;
    // Between the corners the drawn plane, and the field itself.
    for (const double u : {0.1, 0.5, 0.9}) {
      for (const double v : {0.1, 0.5, 0.9}) {
        const double drawn =
            (1 - u) * ((1 - v) * top[0] + v * top[3]) + u * ((1 - v) * top[1] + v * top[2]);
        const double px = x[0] + u * (x[1] - x[0]), py = y[0] + v * (y[1] - y[0]);
        const Terrain::Surface met = terrain.At(px, py, 5);
        EXPECT_TRUE(met.block);
        EXPECT_NEAR(drawn, met.height, 1e-6);
        EXPECT_NEAR(block["stiffness"].get<double>(), terrain.material(met, 4).stiffness * 4, 1e-6);
      }
    }
  }
  EXPECT_EQ(left, 10);
  EXPECT_NE(blocks, GroundJson(config, 1));
}

TEST(GroundJson, StairsClimb) {
  const nlohmann::ordered_json blocks =
      GroundJson(Config("block_field { rows: 4 height: 0 tilt: 0 climb: 0.2 }"), 1);
  ASSERT_EQ(blocks.size(), 8u);
  EXPECT_NEAR(blocks[3]["top"][0].get<double>(), 0.6, 1e-9);
  EXPECT_NEAR(blocks[4]["top"][2].get<double>(), 0.1, 1e-9);
}

TEST(GroundJson, ThereIsNoneWithoutAFieldOrOfOneThatCannotBe) {
  EXPECT_TRUE(GroundJson(Config("block { x: 1 }"), 1).empty());
  EXPECT_TRUE(GroundJson(Config("block_field { rows: 0 }"), 1).empty());
}

}  // namespace
}  // namespace poise
