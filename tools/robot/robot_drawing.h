// What a robot's picture is made of: its visual shapes and meshes, and what stands for those that
// are not there.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "tools/robot/maker_shapes.h"

namespace poise {

/// A page holds that many over all meshes: about a megabyte.
inline constexpr size_t kPageTriangles = 40'000;

struct RobotDrawing {
  /// Solids in body frames; those of kind "mesh" name one of `meshes` by index.
  std::vector<robot::SourceShape> shapes;  ///< `link` is the body's name
  std::vector<int> body, mesh;             ///< of each shape; mesh: -1 for a primitive
  struct Mesh {
    std::vector<float> vertices;    ///< x, y, z, unscaled
    std::vector<unsigned> indices;  ///< three a triangle
  };
  std::vector<Mesh> meshes;
  std::vector<int> capsules;            ///< bodies that are drawn as capsules between their joints
  std::vector<std::string> missing;     ///< meshes that were not found, as the file names them
  std::vector<std::string> unreadable;  ///< "NAME: why"
  size_t triangles = 0, file_triangles = 0;  ///< drawn, and in the files
};

/// Visual shapes; where there are none, or a mesh of theirs is missing, the collision shapes as
/// well. What cannot be read is left out and told: nothing but the picture depends on it.
RobotDrawing DrawRobot(const robot::RobotModel& model, std::string_view maker_text,
                       const MeshPlaces& places, size_t most_triangles = kPageTriangles);

/// One or two sentences for the page and the terminal; empty where the picture is the file's.
std::string WhatIsDrawnInstead(const RobotDrawing& drawing);

/// "visuals", "meshes" and "capsules" of docs/reference/report_format.md.
void AddDrawing(const RobotDrawing& drawing, nlohmann::ordered_json* json);

}  // namespace poise
