// CANopen over EtherCAT (CoE): mailbox messages with expedited SDOs (ETG.1000.6, 5.6).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace poise::ethercat {

inline constexpr size_t kMailboxHeader = 6;
inline constexpr size_t kSdoMessage = kMailboxHeader + 2 + 8;  ///< of an expedited SDO, bytes

enum class MailboxType : uint8_t { kError = 0, kCoe = 3 };

struct MailboxMessage {
  uint16_t address = 0;  ///< station address of the other side, 0: the master
  MailboxType type = MailboxType::kCoe;
  uint8_t counter = 0;               ///< 1 to 7 in turn; 0: not used
  std::span<const uint8_t> payload;  ///< what follows the six-byte header
};

/// nullopt: shorter than its header says.
std::optional<MailboxMessage> DecodeMailbox(std::span<const uint8_t> mailbox);

/// Next value of the counter that tells a repeated mailbox message from a fresh one.
constexpr uint8_t NextMailboxCounter(uint8_t counter) {
  return static_cast<uint8_t>(counter >= 7 ? 1 : counter + 1);
}

enum class CoeService : uint8_t { kEmergency = 1, kSdoRequest = 2, kSdoResponse = 3 };

/// Of the SDO commands those that one message carries.
enum class SdoCommand {
  kUploadRequest,
  kUploadResponse,
  kDownloadRequest,
  kDownloadResponse,
  kAbort,
  kOther,  ///< a segmented or normal transfer
};

struct ObjectAddress {
  uint16_t index = 0;
  uint8_t subindex = 0;
  auto operator<=>(const ObjectAddress&) const = default;
};

struct Sdo {
  SdoCommand command = SdoCommand::kOther;
  ObjectAddress object;
  uint32_t value = 0;  ///< data of `size` bytes, or the abort code
  uint8_t size = 0;    ///< of the data, 1 to 4
};

/// Writes a whole mailbox message; the rest of `mailbox` becomes zero. Preconditions: at least
/// kSdoMessage bytes; not kOther.
void EncodeSdo(const Sdo& sdo, CoeService service, uint16_t address, uint8_t counter,
               std::span<uint8_t> mailbox);

struct Emergency {
  uint16_t code = 0;  ///< as in 603F
  uint8_t error_register = 0;
};
void EncodeEmergency(const Emergency& emergency, uint8_t counter, std::span<uint8_t> mailbox);

struct CoeMessage {
  CoeService service = CoeService::kSdoRequest;
  Sdo sdo;              ///< of kSdoRequest and kSdoResponse
  Emergency emergency;  ///< of kEmergency
};
/// The payload of a CoE mailbox; nullopt when it is too short or of no service above.
std::optional<CoeMessage> DecodeCoe(std::span<const uint8_t> payload);

/// Abort codes that an object dictionary gives (ETG.1000.6, table 41).
enum class SdoAbort : uint32_t {
  kNone = 0,
  kUnknownCommand = 0x05040001,
  kUnsupportedAccess = 0x06010000,
  kWriteOnly = 0x06010001,
  kReadOnly = 0x06010002,
  kSubindexNotWritable = 0x06010003,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kPdoTooLong = 0x06040042,
  kLengthMismatch = 0x06070010,
  kLengthTooHigh = 0x06070012,
  kLengthTooLow = 0x06070013,
  kNoSubindex = 0x06090011,
  kValueRange = 0x06090030,
  kDeviceState = 0x08000022,
};
/// Text of any SDO abort code; "unknown SDO abort code" when it is none of the standard's.
std::string_view SdoAbortText(uint32_t code);

}  // namespace poise::ethercat
