// Check sums of a log's bytes, kept beside it: whether they are those that were written.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace poise::logging {

/// Sums a log while it is written, by blocks, so that an altered one is found by its place.
class LogSums {
 public:
  void Add(std::span<const uint8_t> bytes);
  /// Writes the sums of all bytes added beside the log. Throws LogError.
  void Write(const std::string& log);

 private:
  uint64_t size_ = 0;
  uint32_t sum_ = 0;  // of the block that is not full
  std::vector<uint32_t> blocks_;
};

/// Removes what is beside a log: its bytes are about to change.
void RemoveSums(const std::string& log);

/// What of a log is not as it was written, a line each; empty: nothing. nullopt: no sums are beside
/// it, as of a recording that did not come to its end. Throws LogError when they cannot be read.
std::optional<std::vector<std::string>> CheckSums(const std::string& log);

}  // namespace poise::logging
