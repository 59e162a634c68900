#include "sim/terrain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/balance/minimum_jerk.h"
#include "components/framework/configuration/configuration.h"
#include "sim/random.h"

namespace poise {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

namespace {

constexpr uint64_t kTerrainStream = 1, kFieldStream = 101;
constexpr double kWavelength = 0.12;  // m from crest to crest of a block's irregularity
constexpr double kLaneMiddle = 0.1;   // m from y = 0, about where feet come down

Vector2d Slope(double roll, double pitch) {
  // The normal is the z axis turned by roll about x, then by pitch about y.
  const Vector3d normal(std::sin(pitch) * std::cos(roll), -std::sin(roll),
                        std::cos(pitch) * std::cos(roll));
  return -normal.head<2>() / normal.z();
}

}  // namespace

Terrain::Terrain(const SimConfig& config, uint64_t seed) {
  const Ground& ground = config.ground();
  ground_material_.friction = ground.friction();
  if (config.has_block_field()) ReadField(config.block_field(), seed);
  if (!config.has_block()) return;

  const SoftBlock& block = config.block();
  has_block_ = true;
  center_ = {block.x(), block.y()};
  half_size_ = {block.length() / 2, block.width() / 2};
  height_ = block.height();
  start_ = block.start();
  rise_ = block.rise();
  slope_ = Slope(block.tilt_roll(), block.tilt_pitch());
  block_material_ = {block.friction(), block.stiffness(), block.damping()};

  RandomStream random(seed, kTerrainStream);
  wave_amplitude_ = block.irregularity() / kWaves;
  for (Wave& wave : waves_) {
    const double direction = 2 * pi * random.Uniform();
    wave.number = 2 * pi / kWavelength * Vector2d(std::cos(direction), std::sin(direction));
    wave.phase = 2 * pi * random.Uniform();
  }
}

void Terrain::ReadField(const BlockField& field, uint64_t seed) {
  if (field.most_stiffness() < field.least_stiffness()) {
    throw ConfigError("block_field.most_stiffness", "must be least_stiffness or more");
  }
  field_start_ = field.start();
  field_length_ = field.length();
  field_stagger_ = field.stagger();
  RandomStream random(seed, kFieldStream);
  const auto within = [&](double most) { return most * (2 * random.Uniform() - 1); };
  for (const double lane : {0.0, 0.5}) {
    for (int row = 0; row < field.rows(); ++row) {
      Tile tile;
      tile.height = within(field.height()) + field.climb() * (row + lane);
      const double roll = within(field.tilt());
      tile.slope = Slope(roll, within(field.tilt()));
      const double stiffness =
          field.least_stiffness() *
          std::pow(field.most_stiffness() / field.least_stiffness(), random.Uniform());
      tile.material = {field.friction(), stiffness, field.damping() * std::sqrt(stiffness)};
      field_.push_back(tile);
    }
  }
}

std::vector<Terrain::FieldTop> Terrain::FieldTops() const {
  std::vector<FieldTop> tops;
  const size_t rows = field_.size() / 2;
  for (size_t i = 0; i < field_.size(); ++i) {
    const bool left = i >= rows;
    const double from = field_start_ + (left ? field_stagger_ : 0) +
                        static_cast<double>(left ? i - rows : i) * field_length_;
    tops.push_back({from, from + field_length_, left, field_[i].material.stiffness});
  }
  return tops;
}

int Terrain::FieldBlock(double x, double y) const {
  const auto rows = static_cast<int>(field_.size() / 2);
  const bool left = y > 0;
  const double along = (x - field_start_ - (left ? field_stagger_ : 0)) / field_length_;
  if (!(along >= 0 && along < rows)) return -1;
  return static_cast<int>(along) + (left ? rows : 0);
}

Terrain::Surface Terrain::At(double x, double y, double time) const {
  if (const int block = FieldBlock(x, y); block >= 0) {
    const Tile& tile = field_[static_cast<size_t>(block)];
    const int rows = static_cast<int>(field_.size() / 2), row = block % rows;
    const double middle =
        field_start_ + (row + 0.5) * field_length_ + (block >= rows ? field_stagger_ : 0);
    // Tilted along y about where the feet come down, not about the lanes' common edge.
    const double across = std::abs(y) - kLaneMiddle;
    const double height =
        tile.height + tile.slope.x() * (x - middle) + tile.slope.y() * (y > 0 ? across : -across);
    return {height, 0, Vector3d(-tile.slope.x(), -tile.slope.y(), 1).normalized(), true, block};
  }
  const Surface ground{0, 0, Vector3d::UnitZ(), false};
  // A block without a start is there from the beginning of the run, before time 0.
  if (!has_block_ || (start_ > 0 && time < start_)) return ground;
  const Vector2d place = Vector2d(x, y) - center_;
  if (std::abs(place.x()) > half_size_.x() || std::abs(place.y()) > half_size_.y()) return ground;
  double height = height_ + slope_.dot(place);
  Vector2d slope = slope_;
  if (wave_amplitude_ > 0) {
    for (const Wave& wave : waves_) {
      const double angle = wave.number.dot(place) + wave.phase;
      height += wave_amplitude_ * std::sin(angle);
      slope += wave_amplitude_ * std::cos(angle) * wave.number;
    }
  }
  // A rising block grows from the ground, its relief with it.
  const balance::MinimumJerk rise(std::max(0.0, time - start_), rise_);
  const double velocity = rise.speed * height;
  height *= rise.position;
  slope *= rise.position;
  if (height <= 0) return ground;
  return {height, velocity, Vector3d(-slope.x(), -slope.y(), 1).normalized(), true};
}

ContactMaterial Terrain::material(const Surface& surface, size_t corners) const {
  if (surface.field < 0) return material(surface.block, corners);
  ContactMaterial material = field_[static_cast<size_t>(surface.field)].material;
  material.stiffness /= static_cast<double>(corners);
  material.damping /= static_cast<double>(corners);
  return material;
}

ContactMaterial Terrain::material(bool block, size_t corners) const {
  ContactMaterial material = block ? block_material_ : ground_material_;
  material.stiffness /= static_cast<double>(corners);
  material.damping /= static_cast<double>(corners);
  return material;
}

}  // namespace poise
