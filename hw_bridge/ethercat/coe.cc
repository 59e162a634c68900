#include "hw_bridge/ethercat/coe.h"

#include <algorithm>
#include <iterator>

#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/registers.h"

namespace poise::ethercat {
namespace {

constexpr size_t kInitiate = 8;      // command, index, subindex and four bytes
constexpr size_t kLeastSegment = 7;  // bytes of data in the shortest segment
constexpr uint8_t kExpeditedBit = 0x02, kSizeBit = 0x01, kCompleteBit = 0x10;
constexpr uint8_t kToggleBit = 0x10, kLastBit = 0x01;
// Command specifiers, the upper three bits, mean one thing in a request, another in a response.
constexpr uint8_t kSpecifier = 0xE0, kAbortSpecifier = 0x80;

struct Coding {
  SdoCommand command;
  CoeService service;
  uint8_t specifier;
  bool segment = false;  // has a toggle bit, and names no object
  bool data = false;     // carries the object's data, the beginning of it or a segment
};
constexpr Coding kCodings[] = {
    {SdoCommand::kDownloadSegmentRequest, CoeService::kSdoRequest, 0x00, true, true},
    {SdoCommand::kDownloadRequest, CoeService::kSdoRequest, 0x20, false, true},
    {SdoCommand::kUploadRequest, CoeService::kSdoRequest, 0x40},
    {SdoCommand::kUploadSegmentRequest, CoeService::kSdoRequest, 0x60, true},
    {SdoCommand::kAbort, CoeService::kSdoRequest, kAbortSpecifier},
    {SdoCommand::kUploadSegmentResponse, CoeService::kSdoResponse, 0x00, true, true},
    {SdoCommand::kDownloadSegmentResponse, CoeService::kSdoResponse, 0x20, true},
    {SdoCommand::kUploadResponse, CoeService::kSdoResponse, 0x40, false, true},
    {SdoCommand::kDownloadResponse, CoeService::kSdoResponse, 0x60},
};

const Coding& CodingOf(SdoCommand command) {
  return *std::find_if(std::begin(kCodings), std::end(kCodings) - 1,
                       [command](const Coding& coding) { return coding.command == command; });
}

uint8_t CommandByte(const Sdo& sdo) {
  const Coding& coding = CodingOf(sdo.command);
  uint8_t byte = coding.specifier;
  if (coding.segment) byte |= sdo.toggle ? kToggleBit : uint8_t{0};
  if (coding.segment && coding.data) {
    byte |= sdo.last ? kLastBit : uint8_t{0};
    // Only of the shortest segment are bytes unused.
    if (sdo.data.size() < kLeastSegment) {
      byte |= static_cast<uint8_t>((kLeastSegment - sdo.data.size()) << 1);
    }
  } else if (coding.data) {
    byte |= kSizeBit;
    if (sdo.expedited) {
      byte |= static_cast<uint8_t>(kExpeditedBit | (kExpedited - sdo.data.size()) << 2);
    }
  }
  const bool whole = !coding.segment && sdo.command != SdoCommand::kAbort;
  if (whole && sdo.complete) byte |= kCompleteBit;
  return byte;
}

/// Bytes after the CoE header.
size_t SdoBytes(const Sdo& sdo) {
  const Coding& coding = CodingOf(sdo.command);
  if (coding.segment && coding.data) return std::max(kInitiate, 1 + sdo.data.size());
  return kInitiate + (coding.data && !sdo.expedited ? sdo.data.size() : 0);
}

void PutHeaders(CoeService service, uint16_t address, uint8_t counter, size_t bytes,
                std::span<uint8_t> mailbox) {
  EncodeMailboxHeader(MailboxType::kCoe, address, counter, kCoeHeader + bytes, mailbox);
  Put<uint16_t>(mailbox, kMailboxHeader,
                static_cast<uint16_t>(static_cast<uint16_t>(service) << 12));
}

Sdo DecodeSdo(std::span<const uint8_t> bytes, CoeService service) {
  const uint8_t command = bytes[0];
  const uint8_t specifier = command & kSpecifier;
  Sdo sdo;
  for (const Coding& coding : kCodings) {
    // Some slaves send aborts as responses: what is meant is clear.
    const bool same = coding.service == service || coding.command == SdoCommand::kAbort;
    if (same && coding.specifier == specifier) sdo.command = coding.command;
  }
  const Coding& coding = CodingOf(sdo.command);
  if (coding.segment) {
    sdo.toggle = (command & kToggleBit) != 0;
    if (!coding.data) return sdo;
    sdo.last = (command & kLastBit) != 0;
    sdo.data = bytes.subspan(1);
    if (sdo.data.size() == kLeastSegment) {
      sdo.data = sdo.data.first(kLeastSegment - (command >> 1 & 7));
    }
    return sdo;
  }
  sdo.object = {.index = Get<uint16_t>(bytes, 1), .subindex = bytes[3]};
  if (sdo.command == SdoCommand::kAbort) {
    sdo.abort_code = Get<uint32_t>(bytes, 4);
    return sdo;
  }
  sdo.complete = (command & kCompleteBit) != 0;
  if (!coding.data) return sdo;
  sdo.expedited = (command & kExpeditedBit) != 0;
  if (sdo.expedited) {
    sdo.total = (command & kSizeBit) != 0 ? 4U - (command >> 2 & 3) : 4U;
    sdo.data = bytes.subspan(4, sdo.total);
  } else {
    sdo.total = Get<uint32_t>(bytes, 4);
    sdo.data = bytes.subspan(kInitiate);
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

void EncodeMailboxHeader(MailboxType type, uint16_t address, uint8_t counter, size_t payload,
                         std::span<uint8_t> mailbox) {
  std::fill(mailbox.begin(), mailbox.end(), uint8_t{0});
  Put<uint16_t>(mailbox, 0, static_cast<uint16_t>(payload));
  Put<uint16_t>(mailbox, 2, address);
  mailbox[5] = static_cast<uint8_t>(static_cast<uint8_t>(type) | counter << 4);
}

std::string_view MailboxErrorText(uint16_t detail) {
  constexpr std::string_view kTexts[] = {"unknown",
                                         "syntax of the six-byte header is wrong",
                                         "the mailbox protocol is not supported",
                                         "the channel field has a wrong value",
                                         "the service of the protocol is not supported",
                                         "the header of the protocol is wrong",
                                         "the received data are too short",
                                         "no more memory in the slave",
                                         "the length of data is inconsistent"};
  return kTexts[detail < std::size(kTexts) ? detail : 0];
}

void EncodeMailboxError(MailboxError detail, uint8_t counter, std::span<uint8_t> mailbox) {
  EncodeMailboxHeader(MailboxType::kError, 0, counter, 4, mailbox);
  Put<uint16_t>(mailbox, kMailboxHeader, 1);  // the type: a mailbox command
  Put<uint16_t>(mailbox, kMailboxHeader + 2, static_cast<uint16_t>(detail));
}

size_t EncodedSize(const Sdo& sdo) { return kMailboxHeader + kCoeHeader + SdoBytes(sdo); }

void EncodeSdo(const Sdo& sdo, uint16_t address, uint8_t counter, std::span<uint8_t> mailbox) {
  const Coding& coding = CodingOf(sdo.command);
  PutHeaders(coding.service, address, counter, SdoBytes(sdo), mailbox);
  const std::span<uint8_t> bytes = mailbox.subspan(kMailboxHeader + kCoeHeader);
  bytes[0] = CommandByte(sdo);
  if (coding.segment) {
    std::copy(sdo.data.begin(), sdo.data.end(), bytes.begin() + 1);
    return;
  }
  Put<uint16_t>(bytes, 1, sdo.object.index);
  bytes[3] = sdo.object.subindex;
  if (sdo.command == SdoCommand::kAbort) {
    Put<uint32_t>(bytes, 4, sdo.abort_code);
  } else if (coding.data) {
    if (!sdo.expedited) Put<uint32_t>(bytes, 4, sdo.total);
    std::ranges::copy(sdo.data, bytes.subspan(sdo.expedited ? 4 : kInitiate).begin());
  }
}

void EncodeEmergency(const Emergency& emergency, uint8_t counter, std::span<uint8_t> mailbox) {
  PutHeaders(CoeService::kEmergency, 0, counter, kInitiate, mailbox);
  Put<uint16_t>(mailbox, kMailboxHeader + kCoeHeader, emergency.code);
  mailbox[kMailboxHeader + kCoeHeader + 2] = emergency.error_register;
}

void EncodeSdoInfo(const SdoInfo& info, uint8_t counter, std::span<uint8_t> mailbox) {
  PutHeaders(CoeService::kSdoInformation, 0, counter, kInfoHeader + info.data.size(), mailbox);
  const std::span<uint8_t> bytes = mailbox.subspan(kMailboxHeader + kCoeHeader);
  bytes[0] = static_cast<uint8_t>(static_cast<uint8_t>(info.opcode) | (info.incomplete ? 0x80 : 0));
  Put<uint16_t>(bytes, 2, info.fragments_left);
  std::copy(info.data.begin(), info.data.end(), bytes.begin() + kInfoHeader);
}

std::optional<CoeMessage> DecodeCoe(std::span<const uint8_t> payload) {
  if (payload.size() < kCoeHeader) return std::nullopt;
  CoeMessage message;
  message.service = static_cast<CoeService>(Get<uint16_t>(payload, 0) >> 12);
  const std::span<const uint8_t> bytes = payload.subspan(kCoeHeader);
  switch (message.service) {
    case CoeService::kEmergency:
      if (bytes.size() < kInitiate) return std::nullopt;
      message.emergency = {.code = Get<uint16_t>(bytes, 0), .error_register = bytes[2]};
      return message;
    case CoeService::kSdoRequest:
    case CoeService::kSdoResponse:
      if (bytes.size() < kInitiate) return std::nullopt;
      message.sdo = DecodeSdo(bytes, message.service);
      return message;
    case CoeService::kSdoInformation:
      if (bytes.size() < kInfoHeader) return std::nullopt;
      message.info = {.opcode = static_cast<InfoOpcode>(bytes[0] & 0x7F),
                      .incomplete = (bytes[0] & 0x80) != 0,
                      .fragments_left = Get<uint16_t>(bytes, 2),
                      .data = bytes.subspan(kInfoHeader)};
      return message;
  }
  return std::nullopt;
}

std::string_view SdoAbortText(uint32_t code) {
  constexpr CodeText kTexts[] = {
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
  return TextOf(kTexts, code, "unknown SDO abort code");
}

}  // namespace poise::ethercat
