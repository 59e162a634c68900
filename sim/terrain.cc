#include "sim/terrain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/config_check.h"
#include "sim/minimum_jerk.h"
#include "sim/random.h"

namespace poise {

using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;

namespace {

constexpr double kMaxTilt = 0.8;  // rad
constexpr uint64_t kTerrainStream = 1;

}  // namespace

Terrain::Terrain(const SimConfig& config, uint64_t seed) {
  const Ground& ground = config.ground();
  RequireNotNegative(ground.friction(), "ground.friction");
  ground_material_.friction = ground.friction();
  if (!config.has_block()) return;

  const SoftBlock& block = config.block();
  RequireFinite(block.x(), "block.x");
  RequireFinite(block.y(), "block.y");
  RequirePositive(block.length(), "block.length");
  RequirePositive(block.width(), "block.width");
  RequirePositive(block.height(), "block.height");
  RequirePositive(block.stiffness(), "block.stiffness");
  RequireNotNegative(block.damping(), "block.damping");
  RequireNotNegative(block.irregularity(), "block.irregularity");
  RequirePositive(block.irregularity_wavelength(), "block.irregularity_wavelength");
  RequireNotNegative(block.friction(), "block.friction");
  RequireNotNegative(block.start(), "block.start");
  RequireNotNegative(block.rise(), "block.rise");
  if (!(std::abs(block.tilt_roll()) <= kMaxTilt)) {
    throw ConfigError("block.tilt_roll", "must be within 0.8 rad of level");
  }
  if (!(std::abs(block.tilt_pitch()) <= kMaxTilt)) {
    throw ConfigError("block.tilt_pitch", "must be within 0.8 rad of level");
  }
  has_block_ = true;
  center_ = {block.x(), block.y()};
  half_size_ = {block.length() / 2, block.width() / 2};
  height_ = block.height();
  start_ = block.start();
  rise_ = block.rise();
  // The normal is the z axis turned by roll about x, then by pitch about y.
  const Vector3d normal(std::sin(block.tilt_pitch()) * std::cos(block.tilt_roll()),
                        -std::sin(block.tilt_roll()),
                        std::cos(block.tilt_pitch()) * std::cos(block.tilt_roll()));
  slope_ = -normal.head<2>() / normal.z();
  block_material_ = {block.friction(), block.stiffness(), block.damping()};

  RandomStream random(seed, kTerrainStream);
  wave_amplitude_ = block.irregularity() / kWaves;
  for (Wave& wave : waves_) {
    const double direction = 2 * pi * random.Uniform();
    wave.number = 2 * pi / block.irregularity_wavelength() *
                  Vector2d(std::cos(direction), std::sin(direction));
    wave.phase = 2 * pi * random.Uniform();
  }
}

Terrain::Surface Terrain::At(double x, double y, double time) const {
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
  const MinimumJerk rise(std::max(0.0, time - start_), rise_);
  const double velocity = rise.speed * height;
  height *= rise.position;
  slope *= rise.position;
  if (height <= 0) return ground;
  return {height, velocity, Vector3d(-slope.x(), -slope.y(), 1).normalized(), true};
}

ContactMaterial Terrain::material(bool block, size_t corners) const {
  ContactMaterial material = block ? block_material_ : ground_material_;
  material.stiffness /= static_cast<double>(corners);
  material.damping /= static_cast<double>(corners);
  return material;
}

}  // namespace poise
