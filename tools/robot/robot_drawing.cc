#include "tools/robot/robot_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "fmt/format.h"
#include "tools/robot/mesh_file.h"
#include "tools/robot/robot_json.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;
using robot::SourceShape;
using Kind = SourceShape::Kind;

constexpr int kSteps = 4095;    // of a mesh's box that a page's coordinates are told in
constexpr size_t kFewest = 60;  // triangles that every mesh may have
constexpr size_t kNamed = 3;    // missing meshes that are named

/// The most triangles a mesh may keep so that all keep `most`.
size_t FairShare(std::vector<size_t> triangles, size_t most) {
  std::ranges::sort(triangles);
  for (size_t i = 0; i < triangles.size(); ++i) {
    const size_t share = most / (triangles.size() - i);
    if (triangles[i] > share) return std::max(share, kFewest);
    most -= triangles[i];
  }
  return SIZE_MAX;
}

class Drawer {
 public:
  Drawer(const robot::RobotModel& model, const MeshPlaces& places)
      : model_(model), places_(places) {}

  RobotDrawing Draw(const std::vector<SourceShape>& shapes, size_t most_triangles) {
    const size_t bodies = model_.bodies().size();
    std::vector<bool> drawn(bodies), lacking(bodies);
    for (const SourceShape& shape : shapes) {
      const robot::Frame* const place = model_.FindFrame(shape.link);
      if (place == nullptr || shape.collides) continue;
      const bool added = Add(shape, *place);
      auto&& flag = added ? drawn : lacking;
      flag[static_cast<size_t>(place->body)] = true;
    }
    for (const SourceShape& shape : shapes) {
      const robot::Frame* const place = model_.FindFrame(shape.link);
      if (place == nullptr || !shape.collides) continue;
      const auto b = static_cast<size_t>(place->body);
      if (drawn[b] && !lacking[b]) continue;
      if (!Add(shape, *place))
        lacking[b] = true;
      else if (!lacking[b])
        with_collision_.push_back(b);
    }
    for (const size_t b : with_collision_) drawn[b] = true;
    for (size_t b = 0; b < bodies; ++b) {
      if (!drawn[b] || lacking[b]) result_.capsules.push_back(static_cast<int>(b));
    }
    Simplify(most_triangles);
    return std::move(result_);
  }

 private:
  bool Add(const SourceShape& shape, const robot::Frame& place) {
    if (!HasSize(shape)) return false;
    const int mesh = shape.kind == Kind::kMesh ? MeshOf(shape.mesh) : -1;
    if (shape.kind == Kind::kMesh && mesh < 0) return false;
    SourceShape placed = shape;
    placed.pose = place.pose * shape.pose;
    placed.link = model_.bodies()[static_cast<size_t>(place.body)].name;
    result_.shapes.push_back(std::move(placed));
    result_.body.push_back(place.body);
    result_.mesh.push_back(mesh);
    return true;
  }

  /// Index of `loaded_`; -1: missing or unreadable, told once.
  int MeshOf(const std::string& name) {
    const auto known = by_name_.find(name);
    if (known != by_name_.end()) return known->second;
    int& index = by_name_[name] = -1;
    const std::filesystem::path file = FindMesh(places_, name);
    if (file.empty()) {
      result_.missing.push_back(name);
      return index;
    }
    std::string problem;
    MeshTriangles mesh = LoadMesh(file, &problem);
    if (!problem.empty()) {
      result_.unreadable.push_back(name + ": " + problem);
      return index;
    }
    index = static_cast<int>(loaded_.size());
    loaded_.push_back(std::move(mesh));
    return index;
  }

  void Simplify(size_t most) {
    std::vector<size_t> triangles;
    for (const MeshTriangles& mesh : loaded_) triangles.push_back(mesh.triangles());
    const size_t share = FairShare(triangles, most);
    for (MeshTriangles& mesh : loaded_) {
      result_.file_triangles += mesh.triangles();
      const MeshTriangles fewer = Simplified(std::move(mesh), share);
      result_.triangles += fewer.triangles();
      RobotDrawing::Mesh& kept = result_.meshes.emplace_back();
      for (const auto& v : fewer.vertices)
        kept.vertices.insert(kept.vertices.end(), v.begin(), v.end());
      kept.indices.assign(fewer.indices.begin(), fewer.indices.end());
    }
  }

  const robot::RobotModel& model_;
  const MeshPlaces& places_;
  RobotDrawing result_;
  std::vector<MeshTriangles> loaded_;
  std::map<std::string, int> by_name_;
  std::vector<size_t> with_collision_;  // bodies without visual shapes
};

Json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Whole numbers within the box of `low` and `size`, m.
Json MeshJson(const RobotDrawing::Mesh& mesh) {
  std::array<float, 3> low{HUGE_VALF, HUGE_VALF, HUGE_VALF},
      high{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], mesh.vertices[i]);
    high[i % 3] = std::max(high[i % 3], mesh.vertices[i]);
  }
  Json json;
  json["low"] = low;
  json["size"] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  json["steps"] = kSteps;
  std::vector<int> steps;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const float size = high[i % 3] - low[i % 3];
    steps.push_back(size > 0
                        ? static_cast<int>(std::lround(
                              kSteps * static_cast<double>(mesh.vertices[i] - low[i % 3]) / size))
                        : 0);
  }
  json["vertices"] = std::move(steps);
  json["indices"] = mesh.indices;
  return json;
}

}  // namespace

RobotDrawing DrawRobot(const robot::RobotModel& model, std::string_view maker_text,
                       const MeshPlaces& places, size_t most_triangles) {
  MakerShapes shapes;
  try {
    shapes = ReadShapes(maker_text);
  } catch (const robot::RobotError&) {
    // The robot itself was read elsewhere, from a text of its own: it is drawn as capsules.
  }
  MeshPlaces all = places;
  all.mesh_folder = shapes.mesh_folder;
  return Drawer(model, all).Draw(shapes.shapes, most_triangles);
}

std::string WhatIsDrawnInstead(const RobotDrawing& drawing) {
  std::string text;
  const auto named = [](const std::vector<std::string>& names) {
    std::string list;
    for (size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
      list += (i == 0 ? "" : ", ") + names[i];
    }
    return list + (names.size() > kNamed ? ", ..." : "");
  };
  if (!drawing.missing.empty()) {
    text += fmt::format("{} mesh{} of the file {} not found ({}). ", drawing.missing.size(),
                        drawing.missing.size() == 1 ? "" : "es",
                        drawing.missing.size() == 1 ? "was" : "were", named(drawing.missing));
  }
  if (!drawing.unreadable.empty()) {
    text += fmt::format("{} could not be read ({}). ", drawing.unreadable.size(),
                        named(drawing.unreadable));
  }
  if (text.empty()) return text;
  return text + fmt::format(
                    "{} bodies are drawn as capsules between their joints, with the "
                    "collision shapes that the file has.",
                    drawing.capsules.size());
}

void AddDrawing(const RobotDrawing& drawing, Json* json) {
  (*json)["visuals"] = Json::array();
  for (size_t i = 0; i < drawing.shapes.size(); ++i) {
    const SourceShape& shape = drawing.shapes[i];
    Json visual;
    switch (shape.kind) {
      case Kind::kBox:
        visual = {{"shape", "box"}, {"size", Numbers(shape.size)}};
        break;
      case Kind::kSphere:
        visual = {{"shape", "sphere"}, {"radius", shape.size.x()}};
        break;
      case Kind::kMesh:
        visual = {{"shape", "mesh"}, {"mesh", drawing.mesh[i]}, {"scale", Numbers(shape.size)}};
        break;
      default:
        visual = {{"shape", shape.kind == Kind::kCylinder ? "cylinder" : "capsule"},
                  {"radius", shape.size.x()},
                  {"length", shape.size.y()}};
    }
    visual["body"] = drawing.body[i];
    visual["pose"] = PoseJson(shape.pose);
    (*json)["visuals"].push_back(std::move(visual));
  }
  (*json)["meshes"] = Json::array();
  for (const RobotDrawing::Mesh& mesh : drawing.meshes) (*json)["meshes"].push_back(MeshJson(mesh));
  (*json)["capsules"] = drawing.capsules;
}

}  // namespace poise
