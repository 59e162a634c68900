// What the soles stand on: level rigid ground and, where there is one, a soft block.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/sim.pb.h"
#include "sim/world.h"

namespace poise {

/// A height field z(x, y). Only its top exists: a sole is met at its corners and from above.
class Terrain {
 public:
  struct Surface {
    double height;           ///< m, world
    double velocity;         ///< m/s, upward, of a block that rises
    Eigen::Vector3d normal;  ///< unit, upward
    bool block;              ///< of a block rather than of the ground
    int field = -1;          ///< index of the field's block; −1: none
  };

  /// The block's stiffness and damping are those of a whole sole, shared by its corners.
  /// Throws ConfigError: sizes, stiffness, friction or tilt out of range.
  Terrain(const SimConfig& config, uint64_t seed);

  /// The higher of ground and block at (x, y) at time `time` (s); in a field its block, be it
  /// below the ground.
  Surface At(double x, double y, double time) const;
  /// What the contact of one of a sole's `corners` with the ground or a single block is like.
  ContactMaterial material(bool block, size_t corners) const;
  ContactMaterial material(const Surface& surface, size_t corners) const;

  bool has_field() const { return !field_.empty(); }

  /// A block of the field as long as nothing stands on it.
  struct FieldTop {
    double from, to;   ///< m, along x
    bool left;         ///< y > 0; else the other lane. A lane has no outer edge.
    double stiffness;  ///< N/m, under a whole sole
  };
  /// All tops of the field; At() any place of one tells its height.
  std::vector<FieldTop> FieldTops() const;

 private:
  void ReadField(const BlockField& field, uint64_t seed);
  /// Returns the index of the field's block at (x, y); −1: none.
  int FieldBlock(double x, double y) const;

  struct Wave {
    Eigen::Vector2d number;  // rad/m
    double phase;
  };
  static constexpr int kWaves = 5;

  ContactMaterial ground_material_, block_material_;  // under a whole sole
  bool has_block_ = false;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d half_size_ = Eigen::Vector2d::Zero();
  double height_ = 0, start_ = 0, rise_ = 0;
  Eigen::Vector2d slope_ = Eigen::Vector2d::Zero();  // dz/dx, dz/dy of the tilted top
  double wave_amplitude_ = 0;
  std::array<Wave, kWaves> waves_{};
  struct Tile {
    double height;          // m, of the top's middle
    Eigen::Vector2d slope;  // dz/dx, dz/dy
    ContactMaterial material;
  };
  std::vector<Tile> field_;  // right lane, then left, along x each
  double field_start_ = 0, field_length_ = 1, field_stagger_ = 0;  // m
};

}  // namespace poise
