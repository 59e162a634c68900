// CANopen over EtherCAT (CoE): mailbox messages, SDO transfers of every kind, emergencies and SDO
// information as bytes (ETG.1000.6, 5.6).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace poise::ethercat {

inline constexpr size_t kMailboxHeader = 6;
inline constexpr size_t kCoeHeader = 2;
/// Bytes of an expedited SDO, and of a normal transfer's first message before its data.
inline constexpr size_t kSdoMessage = kMailboxHeader + kCoeHeader + 8;
inline constexpr size_t kSegmentHeader = kMailboxHeader + kCoeHeader + 1;  ///< before its data
inline constexpr size_t kExpedited = 4;  ///< bytes of data at most

enum class MailboxType : uint8_t { kError = 0, kCoe = 3 };

struct MailboxMessage {
  uint16_t address = 0;  ///< station address of the other side, 0: the master
  MailboxType type = MailboxType::kCoe;
  uint8_t counter = 0;               ///< 1 to 7 in turn; 0: not used
  std::span<const uint8_t> payload;  ///< what follows the six-byte header
};

/// nullopt: shorter than its header says.
std::optional<MailboxMessage> DecodeMailbox(std::span<const uint8_t> mailbox);
/// Writes the header of a message with `payload` bytes. Precondition: `mailbox` has room for it.
void EncodeMailboxHeader(MailboxType type, uint16_t address, uint8_t counter, size_t payload,
                         std::span<uint8_t> mailbox);

/// Next value of the counter that tells a repeated mailbox message from a fresh one.
constexpr uint8_t NextMailboxCounter(uint8_t counter) {
  return static_cast<uint8_t>(counter >= 7 ? 1 : counter + 1);
}

/// Details of a mailbox error (ETG.1000.4, table 30) that a slave gives.
enum class MailboxError : uint16_t {
  kUnsupportedProtocol = 2,
  kServiceNotSupported = 4,
  kInvalidHeader = 5,
  kSizeTooShort = 6,
  kInvalidSize = 8,
};
std::string_view MailboxErrorText(uint16_t detail);
void EncodeMailboxError(MailboxError detail, uint8_t counter, std::span<uint8_t> mailbox);

enum class CoeService : uint8_t {
  kEmergency = 1,
  kSdoRequest = 2,
  kSdoResponse = 3,
  kSdoInformation = 8,
};

/// Each request is followed by its response.
enum class SdoCommand {
  kUploadRequest,
  kUploadResponse,   ///< expedited, or the first part of a normal or segmented transfer
  kDownloadRequest,  ///< as kUploadResponse
  kDownloadResponse,
  kUploadSegmentRequest,
  kUploadSegmentResponse,
  kDownloadSegmentRequest,
  kDownloadSegmentResponse,
  kAbort,
  kOther,
};

constexpr SdoCommand ResponseTo(SdoCommand request) {
  return static_cast<SdoCommand>(static_cast<int>(request) + 1);
}

struct ObjectAddress {
  uint16_t index = 0;
  uint8_t subindex = 0;
  auto operator<=>(const ObjectAddress&) const = default;
};

struct Sdo {
  SdoCommand command = SdoCommand::kOther;
  ObjectAddress object = {};  ///< not of segments
  bool complete = false;      ///< complete access: the whole object, from this subindex (0 or 1)
  uint32_t abort_code = 0;
  bool expedited = false;              ///< `data`, 1 to 4 bytes, are the whole object
  uint32_t total = 0;                  ///< bytes of the whole object, of which `data` are the first
  bool toggle = false, last = false;   ///< of segments
  std::span<const uint8_t> data = {};  ///< of the transfer's first message, or of a segment
};

/// Bytes of the mailbox message that carries it, header included; those of an expedited one at
/// least.
size_t EncodedSize(const Sdo& sdo);
/// Writes a whole mailbox message; the rest of `mailbox` becomes zero. The service follows from the
/// command: an abort is an SDO request in both directions (ETG.1000.6, table 40). Preconditions:
/// EncodedSize() bytes at least; not kOther.
void EncodeSdo(const Sdo& sdo, uint16_t address, uint8_t counter, std::span<uint8_t> mailbox);

struct Emergency {
  uint16_t code = 0;  ///< as in 603F
  uint8_t error_register = 0;
};
void EncodeEmergency(const Emergency& emergency, uint8_t counter, std::span<uint8_t> mailbox);

/// SDO information: what objects a slave has (ETG.1000.6, 5.6.3).
enum class InfoOpcode : uint8_t {
  kListRequest = 1,
  kListResponse = 2,
  kObjectRequest = 3,
  kObjectResponse = 4,
  kEntryRequest = 5,
  kEntryResponse = 6,
  kError = 7,
};
struct SdoInfo {
  InfoOpcode opcode = InfoOpcode::kError;
  bool incomplete = false;  ///< more fragments follow
  uint16_t fragments_left = 0;
  std::span<const uint8_t> data = {};  ///< what follows the four-byte information header
};
inline constexpr size_t kInfoHeader = 4;
void EncodeSdoInfo(const SdoInfo& info, uint8_t counter, std::span<uint8_t> mailbox);

struct CoeMessage {
  CoeService service = CoeService::kSdoRequest;
  Sdo sdo = {};              ///< of kSdoRequest and kSdoResponse
  Emergency emergency = {};  ///< of kEmergency
  SdoInfo info = {};         ///< of kSdoInformation
};
/// The payload of a CoE mailbox; nullopt when it is too short or of no service above. Spans point
/// into `payload`.
std::optional<CoeMessage> DecodeCoe(std::span<const uint8_t> payload);

/// Abort codes that an object dictionary gives (ETG.1000.6, table 41).
enum class SdoAbort : uint32_t {
  kNone = 0,
  kToggle = 0x05030000,
  kUnknownCommand = 0x05040001,
  kUnsupportedAccess = 0x06010000,
  kReadOnly = 0x06010002,
  kSubindexNotWritable = 0x06010003,
  kNoObject = 0x06020000,
  kNotMappable = 0x06040041,
  kPdoTooLong = 0x06040042,
  kLengthTooHigh = 0x06070012,
  kLengthTooLow = 0x06070013,
  kNoSubindex = 0x06090011,
  kValueRange = 0x06090030,
  kDeviceState = 0x08000022,
};
/// Text of any SDO abort code; "unknown SDO abort code" when it is none of the standard's.
std::string_view SdoAbortText(uint32_t code);

}  // namespace poise::ethercat
