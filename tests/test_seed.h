// Seeds of what tests draw at random.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace poise {

/// `own` as the test was written with; another one, the same in every run, for each whole number in
/// the environment variable POISE_TEST_SEED: a test must hold for what it draws, not for one draw.
inline uint32_t TestSeed(uint32_t own) {
  const char* const text = std::getenv("POISE_TEST_SEED");
  if (text == nullptr) return own;
  return own + 2654435761u * static_cast<uint32_t>(std::strtoul(text, nullptr, 10));
}

}  // namespace poise
