#include "logging/log_reader.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "components/framework/packet_filter.h"
#include "fmt/format.h"

namespace poise::logging {
namespace {

constexpr size_t kHeaderSize = 4 + 8 + 8 + 4 + 4;
constexpr uint32_t kMagic = 0xEDA1DA01u;
constexpr int32_t kMaxChannel = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr int32_t kMaxData = 1 << 28;

bool MagicAt(const uint8_t* data) { return static_cast<uint32_t>(ReadInt32(data)) == kMagic; }

}  // namespace

LogReader::LogReader(const std::string& path) {
  const auto fail = [&](const char* what) {
    throw LogError(fmt::format("{}: {}: {}", path, what, std::strerror(errno)));
  };
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail("cannot be read");
  struct stat status {};
  if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(fd);
    throw LogError(fmt::format("{}: is not a file", path));
  }
  size_ = static_cast<size_t>(status.st_size);
  if (size_ > 0) {
    void* const map = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd, 0);
    if (map == MAP_FAILED) {
      close(fd);
      fail("cannot be read");
    }
    data_ = static_cast<const uint8_t*>(map);
  }
  close(fd);
}

LogReader::~LogReader() {
  if (data_ != nullptr) munmap(const_cast<uint8_t*>(data_), size_);
}

bool LogReader::ParseAt(size_t position, LogEvent* event, size_t* end) const {
  if (size_ - position < kHeaderSize) return false;
  const uint8_t* header = data_ + position;
  if (!MagicAt(header)) return false;
  const int32_t channel_length = ReadInt32(header + 20);
  const int32_t data_length = ReadInt32(header + 24);
  if (channel_length < 1 || channel_length > kMaxChannel || data_length < 0 ||
      data_length > kMaxData) {
    return false;
  }
  const size_t body = static_cast<size_t>(channel_length) + static_cast<size_t>(data_length);
  if (size_ - position - kHeaderSize < body) return false;
  *end = position + kHeaderSize + body;
  if (size_ - *end >= 4 && !MagicAt(data_ + *end)) {
    // Either the next record is damaged, or this one's lengths are: too long, they swallow a
    // record.
    for (size_t i = position + kHeaderSize; i + 4 <= *end; ++i) {
      if (MagicAt(data_ + i)) return false;
    }
  }
  event->number = ReadInt64(header + 4);
  event->utime = ReadInt64(header + 12);
  event->channel = {reinterpret_cast<const char*>(header + kHeaderSize),
                    static_cast<size_t>(channel_length)};
  event->data = {header + kHeaderSize + channel_length, static_cast<size_t>(data_length)};
  return true;
}

bool LogReader::Next(LogEvent* event) {
  size_t end = 0;
  bool skipping = false;
  while (position_ < size_) {
    if (ParseAt(position_, event, &end)) {
      position_ = end;
      return true;
    }
    damages_ += skipping ? 0 : 1;
    skipping = true;
    ++skipped_;
    ++position_;
  }
  return false;
}

}  // namespace poise::logging
