#include "hw_bridge/ethercat/links/frame.h"

#include <algorithm>

#include "hw_bridge/ethercat/links/bytes.h"

namespace poise::ethercat {
namespace {

constexpr uint16_t kLengthMask = 0x07FF;
constexpr uint16_t kCommandsType = 1;  // in the frame header's upper four bits
constexpr uint16_t kCirculating = 0x4000;
constexpr uint16_t kMoreFollows = 0x8000;
constexpr size_t kLengthField = 6;  // of a datagram's header

}  // namespace

void FrameBuilder::Clear() {
  size_ = kFrameHeader;
  last_ = 0;
  Put<uint16_t>(bytes_, 0, kCommandsType << 12);
}

std::optional<size_t> FrameBuilder::Add(Command command, uint8_t index, uint16_t adp, uint16_t ado,
                                        std::span<const uint8_t> data) {
  const std::optional<size_t> offset = AddZero(command, index, adp, ado, data.size());
  if (offset) std::copy(data.begin(), data.end(), bytes_.begin() + *offset + kDatagramHeader);
  return offset;
}

std::optional<size_t> FrameBuilder::AddZero(Command command, uint8_t index, uint16_t adp,
                                            uint16_t ado, size_t length) {
  if (length > kMaxDatagramData || size_ + length + kDatagramOverhead > kMaxFrame) {
    return std::nullopt;
  }
  if (last_ != 0) {
    const auto field = Get<uint16_t>(bytes_, last_ + kLengthField);
    Put<uint16_t>(bytes_, last_ + kLengthField, field | kMoreFollows);
  }
  const size_t offset = size_;
  std::fill_n(bytes_.begin() + offset, length + kDatagramOverhead, uint8_t{0});
  bytes_[offset] = static_cast<uint8_t>(command);
  bytes_[offset + 1] = index;
  Put<uint16_t>(bytes_, offset + 2, adp);
  Put<uint16_t>(bytes_, offset + 4, ado);
  Put<uint16_t>(bytes_, offset + kLengthField, static_cast<uint16_t>(length));
  size_ = offset + length + kDatagramOverhead;
  last_ = offset;
  Put<uint16_t>(bytes_, 0, static_cast<uint16_t>(kCommandsType << 12 | (size_ - kFrameHeader)));
  return offset;
}

FrameReader::FrameReader(std::span<const uint8_t> bytes) : bytes_(bytes) {
  error_ = Check();
  if (error_ != FrameError::kNone) return;
  end_ = kFrameHeader + (Get<uint16_t>(bytes_, 0) & kLengthMask);
  for (size_t at = kFrameHeader; at < end_; ++num_datagrams_) {
    at += kDatagramOverhead + (Get<uint16_t>(bytes_, at + kLengthField) & kLengthMask);
  }
}

FrameError FrameReader::Check() const {
  if (bytes_.size() < kFrameHeader) return FrameError::kTooShort;
  if (bytes_.size() > kMaxFrame) return FrameError::kTooLong;
  const auto header = Get<uint16_t>(bytes_, 0);
  if (header >> 12 != kCommandsType) return FrameError::kType;
  const size_t end = kFrameHeader + (header & kLengthMask);
  if (end > bytes_.size() || end == kFrameHeader) return FrameError::kLength;
  bool more = true;
  for (size_t at = kFrameHeader; at < end;) {
    if (!more) return FrameError::kChain;
    if (end - at < kDatagramOverhead) return FrameError::kDatagram;
    if (bytes_[at] >= kNumCommands) return FrameError::kUnknownCommand;
    const auto length = Get<uint16_t>(bytes_, at + kLengthField);
    const size_t size = kDatagramOverhead + (length & kLengthMask);
    if (end - at < size) return FrameError::kDatagram;
    more = (length & kMoreFollows) != 0;
    at += size;
  }
  return more ? FrameError::kChain : FrameError::kNone;
}

Datagram FrameReader::At(size_t offset) const {
  const auto length = Get<uint16_t>(bytes_, offset + kLengthField);
  const size_t size = length & kLengthMask;
  return {.command = static_cast<Command>(bytes_[offset]),
          .index = bytes_[offset + 1],
          .adp = Get<uint16_t>(bytes_, offset + 2),
          .ado = Get<uint16_t>(bytes_, offset + 4),
          .irq = Get<uint16_t>(bytes_, offset + 8),
          .circulating = (length & kCirculating) != 0,
          .working_counter = Get<uint16_t>(bytes_, offset + kDatagramHeader + size),
          .data = bytes_.subspan(offset + kDatagramHeader, size),
          .offset = offset};
}

std::optional<Datagram> FrameReader::Next() {
  if (error_ != FrameError::kNone || position_ >= end_) return std::nullopt;
  const Datagram datagram = At(position_);
  position_ += kDatagramOverhead + datagram.data.size();
  return datagram;
}

}  // namespace poise::ethercat
