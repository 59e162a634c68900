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
  uint8_t index = 0;  ///< the master's, returned untouched
  uint16_t adp = 0;   ///< position, station address, or low word of a logical address
  uint16_t ado = 0;   ///< register or memory offset, or high word of a logical address
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

/// Reads a frame of any bytes. Never allocates, never reads outside `bytes`.
class FrameReader {
 public:
  /// Checks the whole frame: its type, a header's length within the bytes and above 0, and
  /// datagrams of known commands that fill that length, the last of which alone says that none
  /// follows. Padding after it is allowed, as Ethernet adds it.
  explicit FrameReader(std::span<const uint8_t> bytes);

  /// False: the bytes are no frame.
  bool valid() const { return num_datagrams_ > 0; }
  int num_datagrams() const { return num_datagrams_; }
  /// Bytes without padding. Precondition: valid().
  size_t size() const { return end_; }
  /// The next datagram, nullopt after the last or when !valid().
  std::optional<Datagram> Next();

 private:
  Datagram At(size_t offset) const;

  std::span<const uint8_t> bytes_;
  size_t end_ = 0;
  size_t position_ = kFrameHeader;
  int num_datagrams_ = 0;
};

}  // namespace poise::ethercat
