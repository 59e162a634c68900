#include "sim/random.h"

#include <cmath>
#include <numbers>

namespace poise {
namespace {

// SplitMix64's finaliser: neighbouring seeds must not give neighbouring engine states.
uint64_t Mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

RandomStream::RandomStream(uint64_t seed, uint64_t stream) : engine_(Mix(Mix(seed) ^ stream)) {}

double RandomStream::Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

double RandomStream::Gaussian() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2 * std::log(1 - Uniform()));  // 1 - u is never zero
  const double angle = 2 * std::numbers::pi * Uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

}  // namespace poise
