#include "logging/log_reader.h"

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

#include "components/framework/bus/packet_filter.h"

namespace poise::logging {
namespace {

constexpr int32_t kMaxChannel = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr int32_t kMaxData = 1 << 28;

// Magics looked at in one record: more are no chance, and a hostile log must not take a time that
// grows with the square of its size.
constexpr int kMaxMagics = 64;
constexpr size_t kHeldBytes = 16 << 20;  // of the file, behind the place of reading
constexpr uint8_t kMagicBytes[] = {0xED, 0xA1, 0xDA, 0x01};

bool MagicAt(const uint8_t* data) {
  return static_cast<uint32_t>(ReadInt32(data)) == kEventLogMagic;
}

/// Size of the record whose header begins at `header`, with `left` bytes of the file from there; 0
/// when none can begin there.
size_t RecordSize(const uint8_t* header, size_t left) {
  if (left < kEventLogHeader || !MagicAt(header)) return 0;
  const int32_t channel_length = ReadInt32(header + 20);
  const int32_t data_length = ReadInt32(header + 24);
  if (channel_length < 1 || channel_length > kMaxChannel || data_length < 0 ||
      data_length > kMaxData) {
    return 0;
  }
  const size_t size =
      kEventLogHeader + static_cast<size_t>(channel_length) + static_cast<size_t>(data_length);
  return size <= left ? size : 0;
}

/// True where a record may end: the file's end or the next record.
bool EndsWell(const uint8_t* at, const uint8_t* end) {
  return at == end || (end - at >= 4 && MagicAt(at));
}

/// True when the record [record, record + size) swallows another one, since its lengths were
/// damaged: one that begins inside it and comes after it by number or, when this one does not end
/// where a record may, ends well itself. The magic alone may stand in a message by chance, but not
/// often.
bool SwallowsRecord(const uint8_t* record, size_t size, const uint8_t* end) {
  const auto number = static_cast<uint64_t>(ReadInt64(record + 4));
  const bool ends_well = EndsWell(record + size, end);
  // A record that swallowed others is followed by a later number. The search is most of Next's
  // time.
  const uint8_t* const next = record + size;
  if (ends_well && end - next >= 12 && static_cast<uint64_t>(ReadInt64(next + 4)) == number + 1) {
    return false;
  }
  const uint8_t* data = record + kEventLogHeader;
  const uint8_t* const last =
      std::min(record + size, end - std::min<ptrdiff_t>(12, end - (record + kEventLogHeader)));
  for (int magics = 0; data < last; ++magics) {
    const size_t reach = static_cast<size_t>(last - data) + sizeof(kMagicBytes) - 1;
    const void* const found = memmem(data, reach, kMagicBytes, sizeof(kMagicBytes));
    if (found == nullptr) return false;
    if (magics == kMaxMagics) return true;
    const auto* const at = static_cast<const uint8_t*>(found);
    if (static_cast<uint64_t>(ReadInt64(at + 4)) - number - 1 < (1u << 20)) return true;
    const size_t inner = ends_well ? 0 : RecordSize(at, static_cast<size_t>(end - at));
    if (inner > 0 && EndsWell(at + inner, end)) return true;
    data = at + 1;
  }
  return false;
}

}  // namespace

const MessageType* TypeByFingerprint(const LogEvent& event) {
  return event.data.size() < 8 ? nullptr : FindMessageType(ReadInt64(event.data.data()));
}

const MessageType* WholeMessageType(const LogEvent& event) {
  const MessageType* const type = TypeByFingerprint(event);
  const auto size = static_cast<int64_t>(event.data.size());
  const bool whole = type != nullptr && type->has_header &&
                     type->well_formed_size(event.data.data(), size) == size;
  return whole ? type : nullptr;
}

bool IsEventLog(const std::string& path) {
  std::array<char, sizeof(kMagicBytes)> begin{};
  std::ifstream in(path, std::ios::binary);
  return in.read(begin.data(), begin.size()) &&
         std::memcmp(begin.data(), kMagicBytes, sizeof(kMagicBytes)) == 0;
}

LogReader::LogReader(const std::string& path)
    : file_(path), data_(file_.data()), size_(file_.size()) {}

bool LogReader::ParseAt(size_t position, LogEvent* event, size_t* end) const {
  const uint8_t* const header = data_ + position;
  const size_t size = RecordSize(header, size_ - position);
  if (size == 0 || SwallowsRecord(header, size, data_ + size_)) return false;
  *end = position + size;
  const auto channel_length = static_cast<size_t>(ReadInt32(header + 20));
  event->number = ReadInt64(header + 4);
  event->utime = ReadInt64(header + 12);
  event->channel = {reinterpret_cast<const char*>(header + kEventLogHeader), channel_length};
  event->data = {header + kEventLogHeader + channel_length,
                 size - kEventLogHeader - channel_length};
  event->offset = position;
  return true;
}

bool LogReader::Next(LogEvent* event) {
  size_t end = 0;
  const size_t begin = position_;
  while (position_ < size_ && !ParseAt(position_, event, &end)) {
    // Reading goes on at the next magic; memmem is much faster than a look at every byte.
    const void* const next =
        memmem(data_ + position_ + 1, size_ - position_ - 1, kMagicBytes, sizeof(kMagicBytes));
    position_ =
        next == nullptr ? size_ : static_cast<size_t>(static_cast<const uint8_t*>(next) - data_);
  }
  const bool found = position_ < size_;
  if (position_ > begin) {
    damage_.push_back({begin, position_ - begin, number_, {}});
    if (found) damage_.back().number_after = event->number;
  }
  if (!found) return false;
  position_ = end;
  number_ = event->number;
  if (position_ - released_ >= 2 * kHeldBytes) LetGo();
  return true;
}

void LogReader::LetGo() {
  // Whoever still looks at these bytes finds them again: the system reads the file once more.
  const size_t until = (position_ - kHeldBytes) & ~(kHeldBytes - 1);
  madvise(const_cast<uint8_t*>(data_) + released_, until - released_, MADV_DONTNEED);
  released_ = until;
}

void LogReader::Rewind() {
  position_ = 0;
  released_ = 0;
  number_ = -1;
  damage_.clear();
}

int64_t LogReader::skipped_bytes() const {
  uint64_t sum = 0;
  for (const LogDamage& damage : damage_) sum += damage.size;
  return static_cast<int64_t>(sum);
}

std::optional<int64_t> LogDamage::lost_events() const {
  // A number may be damaged itself: each record has 29 bytes or more.
  if (!number_after || *number_after <= number_before || number_before < -1) return {};
  const uint64_t lost =
      static_cast<uint64_t>(*number_after) - static_cast<uint64_t>(number_before) - 1;
  if (lost > size / (kEventLogHeader + 1)) return {};
  return static_cast<int64_t>(lost);
}

}  // namespace poise::logging
