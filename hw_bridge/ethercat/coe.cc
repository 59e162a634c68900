#include "hw_bridge/ethercat/coe.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "hw_bridge/ethercat/bytes.h"

namespace poise::ethercat {
namespace {

constexpr size_t kCoeHeader = 2;
constexpr size_t kSdoBytes = 8;
constexpr uint8_t kUpload = 0x40, kDownloadDone = 0x60, kAborted = 0x80;
// Expedited, size indicated; bits 2 and 3: bytes of the four that hold no data.
constexpr uint8_t kExpeditedDownload = 0x23, kExpeditedUpload = 0x43;

uint8_t CommandByte(const Sdo& sdo) {
  const auto unused = static_cast<uint8_t>((4 - sdo.size) << 2);
  switch (sdo.command) {
    case SdoCommand::kUploadRequest:
      return kUpload;
    case SdoCommand::kUploadResponse:
      return kExpeditedUpload | unused;
    case SdoCommand::kDownloadRequest:
      return kExpeditedDownload | unused;
    case SdoCommand::kDownloadResponse:
      return kDownloadDone;
    case SdoCommand::kAbort:
    case SdoCommand::kOther:
      break;
  }
  return kAborted;
}

void PutHeaders(CoeService service, uint16_t address, uint8_t counter, std::span<uint8_t> mailbox) {
  std::fill(mailbox.begin(), mailbox.end(), uint8_t{0});
  Put<uint16_t>(mailbox, 0, kCoeHeader + kSdoBytes);
  Put<uint16_t>(mailbox, 2, address);
  mailbox[5] = static_cast<uint8_t>(static_cast<uint8_t>(MailboxType::kCoe) | counter << 4);
  Put<uint16_t>(mailbox, kMailboxHeader,
                static_cast<uint16_t>(static_cast<uint16_t>(service) << 12));
}

Sdo DecodeSdo(std::span<const uint8_t> bytes, CoeService service) {
  const uint8_t command = bytes[0];
  Sdo sdo{.object = {.index = Get<uint16_t>(bytes, 1), .subindex = bytes[3]},
          .value = Get<uint32_t>(bytes, 4)};
  const bool request = service == CoeService::kSdoRequest;
  // Command specifiers, the upper three bits, mean one thing in a request, another in a response.
  const uint8_t specifier = command & 0xE0;
  if (specifier == kAborted) {
    sdo.command = SdoCommand::kAbort;
    sdo.size = 4;
  } else if (request && specifier == 0x40) {
    sdo.command = SdoCommand::kUploadRequest;
  } else if (!request && specifier == 0x60) {
    sdo.command = SdoCommand::kDownloadResponse;
  } else if (specifier == (request ? 0x20 : 0x40) && (command & 0x02) != 0) {
    sdo.command = request ? SdoCommand::kDownloadRequest : SdoCommand::kUploadResponse;
    const bool sized = (command & 0x01) != 0;
    sdo.size = static_cast<uint8_t>(sized ? 4 - ((command >> 2) & 3) : 4);
    if (sdo.size < 4) sdo.value &= (1U << (8 * sdo.size)) - 1;
  }
  return sdo;
}

}  // namespace

std::optional<MailboxMessage> DecodeMailbox(std::span<const uint8_t> mailbox) {
  if (mailbox.size() < kMailboxHeader) return std::nullopt;
  const auto length = Get<uint16_t>(mailbox, 0);
  if (length > mailbox.size() - kMailboxHeader) return std::nullopt;
  return MailboxMessage{.address = Get<uint16_t>(mailbox, 2),
                        .type = static_cast<MailboxType>(mailbox[5] & 0x0F),
                        .counter = static_cast<uint8_t>(mailbox[5] >> 4 & 7),
                        .payload = mailbox.subspan(kMailboxHeader, length)};
}

void EncodeSdo(const Sdo& sdo, CoeService service, uint16_t address, uint8_t counter,
               std::span<uint8_t> mailbox) {
  PutHeaders(service, address, counter, mailbox);
  const std::span<uint8_t> bytes = mailbox.subspan(kMailboxHeader + kCoeHeader);
  bytes[0] = CommandByte(sdo);
  Put<uint16_t>(bytes, 1, sdo.object.index);
  bytes[3] = sdo.object.subindex;
  PutSized(bytes, 4, sdo.value, sdo.command == SdoCommand::kAbort ? 4 : sdo.size);
}

void EncodeEmergency(const Emergency& emergency, uint8_t counter, std::span<uint8_t> mailbox) {
  PutHeaders(CoeService::kEmergency, 0, counter, mailbox);
  Put<uint16_t>(mailbox, kMailboxHeader + kCoeHeader, emergency.code);
  mailbox[kMailboxHeader + kCoeHeader + 2] = emergency.error_register;
}

std::optional<CoeMessage> DecodeCoe(std::span<const uint8_t> payload) {
  if (payload.size() < kCoeHeader + kSdoBytes) return std::nullopt;
  const int service = Get<uint16_t>(payload, 0) >> 12;
  if (service < 1 || service > 3) return std::nullopt;
  const std::span<const uint8_t> bytes = payload.subspan(kCoeHeader);
  CoeMessage message{.service = static_cast<CoeService>(service), .sdo = {}, .emergency = {}};
  if (message.service == CoeService::kEmergency) {
    message.emergency = {.code = Get<uint16_t>(bytes, 0), .error_register = bytes[2]};
  } else {
    message.sdo = DecodeSdo(bytes, message.service);
  }
  return message;
}

std::string_view SdoAbortText(uint32_t code) {
  constexpr std::pair<uint32_t, std::string_view> kTexts[] = {
      {0x05030000, "toggle bit not changed"},
      {0x05040000, "SDO protocol timeout"},
      {0x05040001, "client/server command specifier not valid or unknown"},
      {0x05040005, "out of memory"},
      {0x06010000, "unsupported access to an object"},
      {0x06010001, "attempt to read a write-only object"},
      {0x06010002, "attempt to write a read-only object"},
      {0x06010003, "subindex cannot be written, subindex 0 must be 0 for write access"},
      {0x06010004, "complete access not supported for objects of variable length"},
      {0x06010005, "object length exceeds mailbox size"},
      {0x06010006, "object mapped to RxPDO, SDO download blocked"},
      {0x06020000, "the object does not exist in the object dictionary"},
      {0x06040041, "the object cannot be mapped into the PDO"},
      {0x06040042, "number and length of the objects to be mapped would exceed the PDO length"},
      {0x06040043, "general parameter incompatibility"},
      {0x06040047, "general internal incompatibility in the device"},
      {0x06060000, "access failed due to a hardware error"},
      {0x06070010, "data type does not match, length of service parameter does not match"},
      {0x06070012, "data type does not match, length of service parameter too high"},
      {0x06070013, "data type does not match, length of service parameter too low"},
      {0x06090011, "subindex does not exist"},
      {0x06090030, "value range of parameter exceeded"},
      {0x06090031, "value of parameter written too high"},
      {0x06090032, "value of parameter written too low"},
      {0x06090036, "maximum value is less than minimum value"},
      {0x08000000, "general error"},
      {0x08000020, "data cannot be transferred or stored to the application"},
      {0x08000021, "data cannot be transferred or stored because of local control"},
      {0x08000022, "data cannot be transferred or stored because of the present device state"},
      {0x08000023, "object dictionary generation fails or no object dictionary is present"},
  };
  const auto* found = std::find_if(std::begin(kTexts), std::end(kTexts),
                                   [code](const auto& entry) { return entry.first == code; });
  return found != std::end(kTexts) ? found->second : "unknown SDO abort code";
}

}  // namespace poise::ethercat
