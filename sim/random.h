// Seeded random numbers that are the same on every standard library.
#pragma once

#include <cstdint>
#include <random>

namespace poise {

/// A stream of its own: streams of the same seed and different `stream` are independent.
class RandomStream {
 public:
  RandomStream(uint64_t seed, uint64_t stream);

  /// Uniform in [0, 1), 53 bits.
  double Uniform();
  /// Standard normal, by Box and Muller (std::normal_distribution may differ between libraries).
  double Gaussian();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0;
  bool has_spare_ = false;
};

}  // namespace poise
