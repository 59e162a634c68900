#include "tools/foxglove/ground_scene.h"

#include <algorithm>

#include "components/framework/configuration/configuration.h"
#include "tools/foxglove/scene_parts.h"

namespace poise {
namespace {

using Eigen::Vector3d;

constexpr SceneColor kFloor{0.30, 0.34, 0.40, 0.6};
constexpr SceneColor kBlock{0.76, 0.62, 0.42};
constexpr double kFloorSide = 8;          // m, of the floor about the origin
constexpr double kFloorBeyond = 3;        // m, of it behind the last block
constexpr double kFloorThickness = 0.02;  // m
constexpr double kFloorDepth = 1e-3;      // m that it lies below z = 0: what lies on it shows
constexpr double kLaneWidth = 1;          // m, of a lane that has no edge
constexpr double kBottom = -0.3;          // m, world, of a field's blocks
constexpr double kInside = 1e-6;          // m from a block's edge, where its top is asked for
constexpr double kAbsent = -1;            // stage of a block that is not there
constexpr int kPatch = 16;                // squares along a side of a block with relief

/// A top of the terrain over a rectangle, with walls down to `bottom`.
void AddPatch(const Terrain& terrain, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
              int squares, double time, double bottom, foxglove::SceneEntity* entity) {
  foxglove::TriangleListPrimitive* const mesh = entity->add_triangles();
  Fill(Eigen::Isometry3d::Identity(), mesh->mutable_pose());
  Fill(kBlock, mesh->mutable_color());
  const auto side = static_cast<uint32_t>(squares + 1);
  const auto place = [&](uint32_t i, double from, double to) {
    const double share = static_cast<double>(i) / squares;
    return std::clamp(from + share * (to - from), from + kInside, to - kInside);
  };
  for (uint32_t i = 0; i < side; ++i) {
    for (uint32_t k = 0; k < side; ++k) {
      const double x = place(i, low.x(), high.x()), y = place(k, low.y(), high.y());
      Fill(Vector3d(x, y, terrain.At(x, y, time).height), mesh->add_points());
    }
  }
  const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) {
    for (const uint32_t corner : {a, b, c}) mesh->add_indices(corner);
  };
  for (uint32_t i = 0; i + 1 < side; ++i) {
    for (uint32_t k = 0; k + 1 < side; ++k) {
      const uint32_t a = i * side + k, b = a + side;
      triangle(a, b, b + 1);
      triangle(a, b + 1, a + 1);
    }
  }
  std::vector<uint32_t> rim;  // anticlockwise, seen from above
  for (uint32_t i = 0; i + 1 < side; ++i) rim.push_back(i * side);
  for (uint32_t k = 0; k + 1 < side; ++k) rim.push_back((side - 1) * side + k);
  for (uint32_t i = side - 1; i > 0; --i) rim.push_back(i * side + side - 1);
  for (uint32_t k = side - 1; k > 0; --k) rim.push_back(k);
  const auto first = static_cast<uint32_t>(mesh->points_size());
  for (const uint32_t top : rim) {
    foxglove::Point3 point = mesh->points(static_cast<int>(top));
    point.set_z(bottom);
    *mesh->add_points() = point;
  }
  for (uint32_t r = 0; r < rim.size(); ++r) {
    const uint32_t next = (r + 1) % static_cast<uint32_t>(rim.size());
    triangle(rim[r], first + r, first + next);
    triangle(rim[r], first + next, rim[next]);
  }
}

/// How far a block has come: kAbsent, then 0 to 1 while it rises.
double BlockStage(const SoftBlock& block, double time) {
  // One without a start is there from the beginning, before time 0.
  if (block.start() > 0 && time < block.start()) return kAbsent;
  return block.rise() > 0 ? std::clamp((time - block.start()) / block.rise(), 0.0, 1.0) : 1;
}

}  // namespace

GroundScene::GroundScene(const Scenario& scenario) : config_(scenario.sim()) {
  try {
    terrain_ = std::make_unique<Terrain>(config_, scenario.seed());
  } catch (const ConfigError&) {
    // What cannot be drawn is left out: nothing but the picture depends on it.
  }
}

void GroundScene::AddFloor(int64_t utime, foxglove::SceneUpdate* scene) const {
  foxglove::SceneEntity* const floor = AddEntity(utime, kWorldFrame, "floor", scene);
  const auto add = [&](double x0, double x1, double y0, double y1) {
    foxglove::CubePrimitive* const cube = floor->add_cubes();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Vector3d((x0 + x1) / 2, (y0 + y1) / 2, -kFloorDepth - kFloorThickness / 2);
    Fill(pose, cube->mutable_pose());
    Fill(Vector3d(x1 - x0, y1 - y0, kFloorThickness), cube->mutable_size());
    Fill(kFloor, cube->mutable_color());
  };
  constexpr double kHalf = kFloorSide / 2;
  if (terrain_ == nullptr || !config_.has_block_field()) {
    add(-kHalf, kHalf, -kHalf, kHalf);
    return;
  }
  // Blocks may lie below it: it has a hole for them.
  const BlockField& field = config_.block_field();
  const double start = field.start(), length = field.rows() * field.length();
  const double end = start + field.stagger() + length;
  add(std::min(-kHalf, start - kFloorBeyond), start, -kHalf, kHalf);
  add(end, end + kFloorBeyond, -kHalf, kHalf);
  if (field.stagger() > 0) {
    add(start, start + field.stagger(), 0, kLaneWidth);
    add(start + length, end, -kLaneWidth, 0);
  }
}

std::optional<foxglove::SceneUpdate> GroundScene::Update(double time, int64_t utime) {
  const SoftBlock& block = config_.block();
  const double stage =
      terrain_ != nullptr && config_.has_block() ? BlockStage(block, time) : kAbsent;
  const bool first = !begun_;
  if (!first && stage == stage_) return {};
  begun_ = true;
  stage_ = stage;

  foxglove::SceneUpdate scene;
  if (first) AddFloor(utime, &scene);
  if (first && terrain_ != nullptr && config_.has_block_field()) {
    const BlockField& field = config_.block_field();
    foxglove::SceneEntity* const blocks = AddEntity(utime, kWorldFrame, "block field", &scene);
    for (const bool left : {false, true}) {
      for (int row = 0; row < field.rows(); ++row) {
        const double x = field.start() + (left ? field.stagger() : 0) + row * field.length();
        const double y = left ? 0 : -kLaneWidth;
        AddPatch(*terrain_, {x, y}, {x + field.length(), y + kLaneWidth}, 1, 0, kBottom, blocks);
      }
    }
  }
  if (stage > kAbsent) {
    const Eigen::Vector2d centre(block.x(), block.y());
    const Eigen::Vector2d half(block.length() / 2, block.width() / 2);
    AddPatch(*terrain_, centre - half, centre + half, kPatch, time, 0,
             AddEntity(utime, kWorldFrame, "block", &scene));
  }
  return scene;
}

}  // namespace poise
