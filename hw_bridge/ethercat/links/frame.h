// EtherCAT frames: a header and a chain of datagrams (IEC 61158-4-12, ETG.1000.4).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace poise::ethercat {

inline constexpr uint16_t kEtherType = 0x88A4;
inline constexpr uint16_t kUdpPort = 0x88A4;  ///< 34980
/// Bytes of EtherCAT header and datagrams that fit the 1500 of an Ethernet frame's payload.
inline constexpr size_t kMaxFrame = 1500;
inline constexpr size_t kFrameHeader = 2;
inline constexpr size_t kDatagramHeader = 10;
inline constexpr size_t kWorkingCounter = 2;
inline constexpr size_t kDatagramOverhead = kDatagramHeader + kWorkingCounter;
inline constexpr size_t kMaxDatagramData = kMaxFrame - kFrameHeader - kDatagramOverhead;

enum class Command : uint8_t {
  kNop = 0,
  kAprd = 1,   ///< auto-increment physical read
  kApwr = 2,   ///< auto-increment physical write
  kAprw = 3,   ///< auto-increment physical read and write
  kFprd = 4,   ///< configured address physical read
  kFpwr = 5,   ///< configured address physical write
  kFprw = 6,   ///< configured address physical read and write
  kBrd = 7,    ///< broadcast read
  kBwr = 8,    ///< broadcast write
  kBrw = 9,    ///< broadcast read and write
  kLrd = 10,   ///< logical read
  kLwr = 11,   ///< logical write
  kLrw = 12,   ///< logical read and write
  kArmw = 13,  ///< auto-increment physical read, multiple write
  kFrmw = 14,  ///< configured address physical read, multiple write
};
inline constexpr uint8_t kNumCommands = 15;

/// Address field of auto-increment commands for the slave at `position` (0: first).
constexpr uint16_t AutoIncrementAddress(int position) { return static_cast<uint16_t>(-position); }

/// A datagram inside a frame's bytes. Spans point into the frame.
struct Datagram {
  Command command = Command::kNop;
  uint8_t index = 0;         ///< the master's, returned untouched
  uint16_t adp = 0;          ///< position, station address, or low word of a logical address
  uint16_t ado = 0;          ///< register or memory offset, or high word of a logical address
  uint16_t irq = 0;          ///< event bits of the slaves
  bool circulating = false;  ///< has passed a slave with a closed port before
  uint16_t working_counter = 0;
  std::span<const uint8_t> data;
  size_t offset = 0;  ///< of the datagram's header in the frame
  uint32_t logical_address() const { return uint32_t{ado} << 16 | adp; }
};

/// Builds a frame in place. Never allocates.
class FrameBuilder {
 public:
  FrameBuilder() { Clear(); }
  void Clear();

  /// Appends a datagram; `data` is what is written (reads: any bytes, usually zero) and sets its
  /// length. Returns the offset of its header; nullopt, and the frame stays, when it does not fit.
  std::optional<size_t> Add(Command command, uint8_t index, uint16_t adp, uint16_t ado,
                            std::span<const uint8_t> data);
  /// Adds a datagram of `length` zero bytes, as Add does.
  std::optional<size_t> AddZero(Command command, uint8_t index, uint16_t adp, uint16_t ado,
                                size_t length);
  std::optional<size_t> AddLogical(Command command, uint8_t index, uint32_t address,
                                   std::span<const uint8_t> data) {
    return Add(command, index, static_cast<uint16_t>(address), static_cast<uint16_t>(address >> 16),
               data);
  }

  bool empty() const { return size_ == kFrameHeader; }
  std::span<const uint8_t> bytes() const { return std::span(bytes_).first(size_); }

 private:
  std::array<uint8_t, kMaxFrame> bytes_{};
  size_t size_ = kFrameHeader;
  size_t last_ = 0;  // header of the last datagram, 0: none
};

/// Why bytes are not a frame.
enum class FrameError {
  kNone,
  kTooShort,        ///< no room for the header
  kTooLong,         ///< longer than Ethernet carries
  kType,            ///< not of type 1, EtherCAT commands
  kLength,          ///< the header's length is beyond the bytes, or 0
  kDatagram,        ///< a datagram's header or data is beyond the header's length
  kChain,           ///< "more follows" at the end, or bytes after the last datagram
  kUnknownCommand,  ///< a command number of no command
};
inline constexpr int kNumFrameErrors = 8;

/// Reads a frame of any bytes. Never allocates, never reads outside `bytes`.
class FrameReader {
 public:
  /// Checks the whole frame; padding after the header's length is allowed, as Ethernet adds it.
  explicit FrameReader(std::span<const uint8_t> bytes);

  FrameError error() const { return error_; }
  int num_datagrams() const { return num_datagrams_; }
  /// Bytes without padding. Precondition: error() == kNone.
  size_t size() const { return end_; }
  /// The next datagram, nullopt after the last or when error() != kNone.
  std::optional<Datagram> Next();

 private:
  FrameError Check() const;
  Datagram At(size_t offset) const;

  std::span<const uint8_t> bytes_;
  size_t end_ = 0;
  size_t position_ = kFrameHeader;
  FrameError error_ = FrameError::kNone;
  int num_datagrams_ = 0;
};

}  // namespace poise::ethercat
