// What readers recover from a damaged log.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace poise::logging {

struct DamageTrial {
  int64_t records = 0;    ///< in the whole log
  int64_t undamaged = 0;  ///< of which all bytes are still there
  int64_t by_poise = 0;   ///< undamaged ones that LogReader gives, byte for byte
  int64_t by_liblcm = 0;  ///< that liblcm's lcm_eventlog_* gives, up to where it stops
  bool liblcm_crashed = false;
};

/// The log's bytes cut at a random place.
std::string CutAnywhere(const std::string& bytes, std::mt19937* random);
/// With `count` bytes at random places overwritten with random values.
std::string Overwrite(std::string bytes, size_t count, std::mt19937* random);

/// Reads `damaged`, made from the log `whole`, with both readers; liblcm's in a process of its own,
/// which may die. `path`: file to use.
DamageTrial TryDamage(const std::string& whole, const std::string& damaged,
                      const std::string& path);

}  // namespace poise::logging
