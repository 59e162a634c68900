#include "logging/log_reader.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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

/// True when a record that comes after record `number` begins in [data, data + size), before
/// `end` of the file. The magic alone may stand in a message by chance.
bool HoldsRecordAfter(int64_t number, const uint8_t* data, size_t size, const uint8_t* end) {
  constexpr uint8_t kMagicBytes[] = {0xED, 0xA1, 0xDA, 0x01};
  const uint8_t* const last = std::min(data + size, end - std::min<ptrdiff_t>(12, end - data));
  while (data < last) {
    const size_t reach = static_cast<size_t>(last - data) + sizeof(kMagicBytes) - 1;
    const void* const found = memmem(data, reach, kMagicBytes, sizeof(kMagicBytes));
    if (found == nullptr) return false;
    const auto* const at = static_cast<const uint8_t*>(found);
    const auto ahead = static_cast<uint64_t>(ReadInt64(at + 4)) - static_cast<uint64_t>(number);
    if (ahead - 1 < (1u << 20)) return true;
    data = at + 1;
  }
  return false;
}

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
  // Lengths that were damaged may swallow later records.
  if (HoldsRecordAfter(ReadInt64(header + 4), header + kHeaderSize, body, data_ + size_))
    return false;
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
