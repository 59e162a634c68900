#include "tools/report/ground_json.h"

#include <nlohmann/json.hpp>

#include "components/framework/configuration/configuration.h"
#include "sim/terrain.h"

namespace poise {
namespace {

constexpr double kLaneWidth = 0.5;  // m, drawn of a lane, which has no outer edge
constexpr double kInside = 1e-9;    // m from a block's edge, where its top is asked for

}  // namespace

nlohmann::ordered_json GroundJson(const SimConfig& config, uint64_t seed) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  try {
    const Terrain terrain(config, seed);
    for (const Terrain::FieldTop& top : terrain.FieldTops()) {
      const double low = top.left ? 0 : -kLaneWidth, high = top.left ? kLaneWidth : 0;
      nlohmann::ordered_json heights = nlohmann::ordered_json::array();
      const double x[] = {top.from + kInside, top.to - kInside, top.to - kInside,
                          top.from + kInside};
      const double y[] = {low + kInside, low + kInside, high - kInside, high - kInside};
      for (size_t i = 0; i < 4; ++i) heights.push_back(terrain.At(x[i], y[i], 0).height);
      json.push_back({{"x", {top.from, top.to}},
                      {"y", {low, high}},
                      {"top", heights},
                      {"stiffness", top.stiffness}});
    }
  } catch (const ConfigError&) {
    // What cannot be drawn is left out: nothing but the picture depends on it.
  }
  return json;
}

}  // namespace poise
