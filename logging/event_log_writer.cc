#include "logging/event_log_writer.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "fmt/format.h"

namespace poise::logging {

EventLogWriter::EventLogWriter(const std::string& path)
    : path_(path), log_(lcm_eventlog_create(path.c_str(), "w")) {
  if (!log_) throw LogError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
}

void EventLogWriter::Write(std::string_view channel, int64_t utime, std::span<const uint8_t> data) {
  channel_ = channel;
  lcm_eventlog_event_t event{};
  event.timestamp = utime;
  event.channellen = static_cast<int32_t>(channel_.size());
  event.datalen = static_cast<int32_t>(data.size());
  event.channel = channel_.data();
  event.data = const_cast<uint8_t*>(data.data());  // liblcm only reads it
  if (lcm_eventlog_write_event(log_.get(), &event) != 0) {
    throw LogError(fmt::format("{}: writing failed: {}", path_, std::strerror(errno)));
  }
  ++events_;
}

void EventLogWriter::Flush() {
  if (log_ && std::fflush(log_->f) != 0) {
    throw LogError(fmt::format("{}: writing failed: {}", path_, std::strerror(errno)));
  }
}

void EventLogWriter::Close() {
  Flush();
  log_.reset();
}

}  // namespace poise::logging
