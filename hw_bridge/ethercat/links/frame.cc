#include "hw_bridge/ethercat/links/frame.h"

#include <algorithm>

#include "hw_bridge/ethercat/links/bytes.h"

namespace poise::ethercat {
namespace {

constexpr uint16_t kLengthMask = 0x07FF;
constexpr uint16_t kCommandsType = 1;  // in the frame header's upper four bits
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
  if (bytes.size() < kFrameHeader || bytes.size() > kMaxFrame) return;
  const auto header = Get<uint16_t>(bytes, 0);
  const size_t end = kFrameHeader + (header & kLengthMask);
  if (header >> 12 != kCommandsType || end > bytes.size()) return;
  int count = 0;
  bool more = true;
  for (size_t at = kFrameHeader; at < end; ++count) {
    if (!more || end - at < kDatagramOverhead || bytes[at] >= kNumCommands) return;
    const auto length = Get<uint16_t>(bytes, at + kLengthField);
    const size_t size = kDatagramOverhead + (length & kLengthMask);
    if (end - at < size) return;
    more = (length & kMoreFollows) != 0;
    at += size;
  }
  if (more) return;
  end_ = end;
  num_datagrams_ = count;
}

Datagram FrameReader::At(size_t offset) const {
  const auto length = Get<uint16_t>(bytes_, offset + kLengthField);
  const size_t size = length & kLengthMask;
  return {.command = static_cast<Command>(bytes_[offset]),
          .index = bytes_[offset + 1],
          .adp = Get<uint16_t>(bytes_, offset + 2),
          .ado = Get<uint16_t>(bytes_, offset + 4),
          .working_counter = Get<uint16_t>(bytes_, offset + kDatagramHeader + size),
          .data = bytes_.subspan(offset + kDatagramHeader, size),
          .offset = offset};
}

std::optional<Datagram> FrameReader::Next() {
  if (position_ >= end_) return std::nullopt;
  const Datagram datagram = At(position_);
  position_ += kDatagramOverhead + datagram.data.size();
  return datagram;
}

}  // namespace poise::ethercat
