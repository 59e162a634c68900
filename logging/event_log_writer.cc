#include "logging/event_log_writer.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "fmt/format.h"

namespace poise::logging {
namespace {

/// Big endian.
template <class Word>
void Append(Word word, std::vector<uint8_t>* to) {
  for (int shift = 8 * static_cast<int>(sizeof word) - 8; shift >= 0; shift -= 8) {
    to->push_back(static_cast<uint8_t>(word >> shift));
  }
}

}  // namespace

EventLogWriter::EventLogWriter(const std::string& path)
    : path_(path), log_(lcm_eventlog_create(path.c_str(), "w")) {
  if (!log_) throw LogError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  RemoveSums(path);
}

void PutRecord(int64_t number, std::string_view channel, int64_t utime,
               std::span<const uint8_t> data, std::vector<uint8_t>* record) {
  record->clear();
  Append(kEventLogMagic, record);
  Append(static_cast<uint64_t>(number), record);
  Append(static_cast<uint64_t>(utime), record);
  Append(static_cast<uint32_t>(channel.size()), record);
  Append(static_cast<uint32_t>(data.size()), record);
  record->insert(record->end(), channel.begin(), channel.end());
  record->insert(record->end(), data.begin(), data.end());
}

void EventLogWriter::Write(std::string_view channel, int64_t utime, std::span<const uint8_t> data) {
  PutRecord(events_, channel, utime, data, &record_);
  if (std::fwrite(record_.data(), 1, record_.size(), log_->f) != record_.size()) {
    throw LogError(fmt::format("{}: writing failed: {}", path_, std::strerror(errno)));
  }
  sums_.Add(record_);
  ++events_;
}

void EventLogWriter::Flush() {
  if (log_ && std::fflush(log_->f) != 0) {
    throw LogError(fmt::format("{}: writing failed: {}", path_, std::strerror(errno)));
  }
}

void EventLogWriter::Close(bool sums) {
  Flush();
  log_.reset();
  if (sums) sums_.Write(path_);
}

}  // namespace poise::logging
