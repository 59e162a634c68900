#include "logging/log_sums.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "fmt/format.h"
#include "logging/event_log_writer.h"
#include "logging/log_reader.h"

namespace poise::logging {
namespace {

constexpr uint64_t kBlock = 1 << 20;  // bytes

std::string SumsPath(const std::string& log) { return log + ".crc32"; }

uint32_t Sum(uint32_t before, std::span<const uint8_t> bytes) {
  return static_cast<uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace

void LogSums::Add(std::span<const uint8_t> bytes) {
  while (!bytes.empty()) {
    const uint64_t room = kBlock - size_ % kBlock;
    const std::span<const uint8_t> part = bytes.first(std::min<size_t>(room, bytes.size()));
    sum_ = Sum(sum_, part);
    size_ += part.size();
    bytes = bytes.subspan(part.size());
    if (size_ % kBlock != 0) continue;
    blocks_.push_back(sum_);
    sum_ = 0;
  }
}

void LogSums::Write(const std::string& log) {
  if (size_ % kBlock != 0) blocks_.push_back(sum_);
  std::ofstream out(SumsPath(log));
  out << fmt::format("{} bytes, CRC-32 of each {}\n", size_, kBlock);
  for (const uint32_t block : blocks_) out << fmt::format("{:08x}\n", block);
  if (!out.flush()) {
    throw LogError(fmt::format("{}: cannot be written: {}", SumsPath(log), std::strerror(errno)));
  }
}

void RemoveSums(const std::string& log) {
  std::error_code error;  // there need not be any
  std::filesystem::remove(SumsPath(log), error);
}

std::optional<std::vector<std::string>> CheckSums(const std::string& log) {
  std::ifstream in(SumsPath(log));
  if (!in) return std::nullopt;
  uint64_t size = 0, block = 0;
  std::string word;
  in >> size >> word >> word >> word >> word >> block;
  if (!in || block != kBlock) {
    throw LogError(fmt::format("{}: is no list of check sums of a log", SumsPath(log)));
  }
  std::vector<std::string> problems;
  const LogReader reader(log);
  if (reader.file_size() != size) {
    problems.push_back(
        fmt::format("it has {} bytes, and {} were written", reader.file_size(), size));
  }
  for (uint64_t at = 0; at < std::min(size, reader.file_size()); at += kBlock) {
    const uint64_t end = std::min({at + kBlock, size, reader.file_size()});
    std::string expected;
    in >> expected;
    if (end < std::min(at + kBlock, size)) break;  // cut short, as is said above
    const std::string found =
        fmt::format("{:08x}", Sum(0, {reader.bytes() + at, static_cast<size_t>(end - at)}));
    if (found == expected) continue;
    problems.push_back(fmt::format("bytes {} to {} are not those that were written", at, end - 1));
  }
  return problems;
}

}  // namespace poise::logging
