#include "hw_bridge/ethercat/slave_access.h"

#include <fmt/format.h>

#include <algorithm>

namespace poise::ethercat {
namespace {

constexpr size_t kExpedited = 4;           // bytes at most
constexpr size_t kMostObject = 64 * 1024;  // bytes that a slave may announce of one object
constexpr size_t kInitiateBytes = 16;      // headers and the first eight bytes of a normal transfer
constexpr size_t kSegmentBytes = 9;        // headers and command of a segment
constexpr size_t kLeastMailbox = kSdoMessage;

std::string Text(ObjectAddress object) {
  return fmt::format("object {:04X}:{:02X}", object.index, object.subindex);
}

bool IsSegmentRequest(SdoCommand command) {
  return command == SdoCommand::kUploadSegmentRequest ||
         command == SdoCommand::kDownloadSegmentRequest;
}

SdoCommand AnswerTo(SdoCommand request) {
  switch (request) {
    case SdoCommand::kUploadRequest:
      return SdoCommand::kUploadResponse;
    case SdoCommand::kDownloadRequest:
      return SdoCommand::kDownloadResponse;
    case SdoCommand::kUploadSegmentRequest:
      return SdoCommand::kUploadSegmentResponse;
    default:
      return SdoCommand::kDownloadSegmentResponse;
  }
}

}  // namespace

bool SlaveAccess::SetUpMailbox() {
  out_ = in_ = {};
  const uint32_t out = ReadEeprom(sii::kMailboxOutOffset);
  const uint32_t in = ReadEeprom(sii::kMailboxInOffset);
  if ((ReadEeprom(sii::kMailboxProtocols) & sii::kProtocolCoe) == 0) return false;
  const MailboxArea areas[] = {
      {.offset = static_cast<uint16_t>(out), .size = static_cast<uint16_t>(out >> 16)},
      {.offset = static_cast<uint16_t>(in), .size = static_cast<uint16_t>(in >> 16)}};
  for (const MailboxArea& area : areas) {
    if (area.size < kLeastMailbox || area.size > kMaxDatagramData || area.offset < reg::kRam) {
      Fail(fmt::format("its EEPROM gives a mailbox at 0x{:04X} of {} bytes, which cannot be",
                       area.offset, area.size));
    }
  }
  out_ = areas[0];
  in_ = areas[1];
  const auto set = [this](SyncManager manager, const MailboxArea& area, uint8_t control) {
    std::array<uint8_t, kSyncManagerSize> bytes{};
    Put<uint16_t>(bytes, 0, area.offset);
    Put<uint16_t>(bytes, 2, area.size);
    bytes[4] = control;
    bytes[6] = kSmEnable;
    Write(static_cast<uint16_t>(reg::kSyncManager + manager * kSyncManagerSize), bytes);
  };
  set(kMailboxOut, out_, kSmMailboxOut);
  set(kMailboxIn, in_, kSmMailboxIn);
  repeat_ = false;
  received_counter_ = 0;
  return true;
}

uint32_t SlaveAccess::Upload(ObjectAddress object, uint8_t* size) {
  const std::vector<uint8_t> bytes = UploadBytes(object);
  if (bytes.empty() || bytes.size() > kExpedited) {
    Fail(fmt::format("reading {}: it has {} bytes, a number has 1 to 4", ethercat::Text(object),
                     bytes.size()));
  }
  if (size != nullptr) *size = static_cast<uint8_t>(bytes.size());
  return static_cast<uint32_t>(GetSized(bytes, 0, bytes.size()));
}

std::vector<uint8_t> SlaveAccess::UploadBytes(ObjectAddress object, bool complete) {
  const std::string what =
      fmt::format("reading {}{}", ethercat::Text(object), complete ? " with complete access" : "");
  const Sdo first = Exchange(
      {.command = SdoCommand::kUploadRequest, .object = object, .complete = complete}, what);
  std::vector<uint8_t> bytes;
  if (first.size > 0) {
    bytes.resize(first.size);
    PutSized(bytes, 0, first.value, first.size);
    return bytes;
  }
  const size_t total = first.total;
  if (total > kMostObject) Fail(fmt::format("{}: it announces {} bytes", what, total));
  bytes.assign(first.data.begin(), first.data.end());
  bool toggle = false, last = false;
  while (bytes.size() < total && !last) {
    const Sdo part = Exchange(
        {.command = SdoCommand::kUploadSegmentRequest, .object = object, .toggle = toggle}, what);
    if (part.toggle != toggle) Fail(what + ": a segment came twice (toggle bit not changed)");
    bytes.insert(bytes.end(), part.data.begin(), part.data.end());
    last = part.last;
    toggle = !toggle;
  }
  if (bytes.size() < total) {
    Fail(fmt::format("{}: it ends after {} of {} bytes", what, bytes.size(), total));
  }
  bytes.resize(total);  // a mailbox may be longer than what it announces
  return bytes;
}

void SlaveAccess::Download(ObjectAddress object, uint32_t value, uint8_t size) {
  std::array<uint8_t, kExpedited> bytes{};
  PutSized(bytes, 0, value, size);
  DownloadBytes(object, std::span(bytes).first(size));
}

void SlaveAccess::DownloadBytes(ObjectAddress object, std::span<const uint8_t> data,
                                bool complete) {
  const std::string what =
      fmt::format("writing {}{}", ethercat::Text(object), complete ? " with complete access" : "");
  Sdo request{.command = SdoCommand::kDownloadRequest, .object = object, .complete = complete};
  if (data.size() <= kExpedited) {
    request.size = static_cast<uint8_t>(data.size());
    request.value = static_cast<uint32_t>(GetSized(data, 0, data.size()));
    static_cast<void>(Exchange(request, what));
    return;
  }
  const size_t room = out_.size > kInitiateBytes ? out_.size - kInitiateBytes : 0U;
  size_t done = std::min(data.size(), room);
  request.total = static_cast<uint32_t>(data.size());
  request.data = data.first(done);
  static_cast<void>(Exchange(request, what));
  for (bool toggle = false; done < data.size(); toggle = !toggle) {
    const size_t part = std::min(data.size() - done, out_.size - kSegmentBytes);
    const Sdo answer = Exchange({.command = SdoCommand::kDownloadSegmentRequest,
                                 .object = object,
                                 .toggle = toggle,
                                 .last = done + part == data.size(),
                                 .data = data.subspan(done, part)},
                                what);
    if (answer.toggle != toggle) Fail(what + ": a segment was taken twice (toggle bit)");
    done += part;
  }
}

Sdo SlaveAccess::Exchange(const Sdo& request, const std::string& what) {
  if (out_.size == 0) Fail(what + ": the mailbox is not set up; the slave has to be in PRE-OP");
  const int64_t deadline = Now() + timeouts_.mailbox;
  mailbox_counter_ = NextMailboxCounter(mailbox_counter_);
  std::vector<uint8_t> mailbox(out_.size);
  EncodeSdo(request, 0, mailbox_counter_, mailbox);
  SendMailbox(mailbox, deadline, what);
  while (true) {
    const CoeMessage message = ReceiveCoe(deadline, what);
    if (message.service == CoeService::kSdoInformation) continue;
    const Sdo& sdo = message.sdo;
    // An answer of another object belongs to a request that had been given up; segments name no
    // object.
    const bool ours = IsSegmentRequest(request.command) || sdo.object == request.object;
    if (ours && sdo.command == SdoCommand::kAbort) {
      throw SdoAbortError(fmt::format("{}: {}: SDO abort 0x{:08X} ({})", Describe(), what,
                                      sdo.value, SdoAbortText(sdo.value)),
                          sdo.value);
    }
    if (ours && sdo.command == AnswerTo(request.command)) return sdo;
  }
}

CoeMessage SlaveAccess::ReceiveCoe(int64_t deadline, const std::string& what) {
  while (true) {
    ReceiveMailbox(deadline, what);
    if (const std::optional<CoeMessage> message = TakeReceived(what)) return *message;
  }
}

std::optional<CoeMessage> SlaveAccess::TakeReceived(const std::string& what) {
  const std::optional<MailboxMessage> message = DecodeMailbox(received_);
  if (!message) Fail(what + ": the answer is longer than the mailbox");
  if (message->counter != 0 && message->counter == received_counter_) return std::nullopt;
  received_counter_ = message->counter;
  if (message->type == MailboxType::kError) {
    const auto detail =
        static_cast<uint16_t>(message->payload.size() < 4 ? 0 : Get<uint16_t>(message->payload, 2));
    Fail(fmt::format("{}: mailbox error 0x{:04X} ({})", what, detail, MailboxErrorText(detail)));
  }
  if (message->type != MailboxType::kCoe) return std::nullopt;
  std::optional<CoeMessage> coe = DecodeCoe(message->payload);
  if (coe && coe->service == CoeService::kEmergency) {
    emergency_ = coe->emergency;
    ++emergencies_;
    return std::nullopt;
  }
  return coe;
}

void SlaveAccess::PollMailbox() {
  if (in_.size == 0) return;
  const auto status =
      Read<uint8_t>(static_cast<uint16_t>(reg::kSyncManager + kMailboxIn * kSyncManagerSize + 5));
  if ((status & kSmStatusFull) == 0) return;
  const std::string what = "reading its mailbox";
  ReceiveMailbox(Now() + timeouts_.mailbox, what);
  static_cast<void>(TakeReceived(what));
}

void SlaveAccess::SendMailbox(std::span<uint8_t> mailbox, int64_t deadline,
                              const std::string& what) {
  // A frame lost on its way back has filled the mailbox; the slave knows the repetition by its
  // counter and answers once.
  std::vector<uint8_t> bytes(mailbox.begin(), mailbox.end());
  while (true) {
    const auto counter = transactions_->Execute(Command::kFpwr, station_, out_.offset, bytes, 1);
    if (counter && *counter == 1) return;
    if (Now() > deadline) Fail(what + ": its mailbox stays full until the timeout");
    if (counter) Pause();
  }
}

void SlaveAccess::ReceiveMailbox(int64_t deadline, const std::string& what) {
  received_.assign(in_.size, 0);
  while (true) {
    const auto counter = transactions_->Execute(Command::kFprd, station_, in_.offset, received_, 1);
    if (counter && *counter == 1) return;
    if (Now() > deadline) Fail(what + ": no answer by the timeout");
    if (counter) {
      Pause();
      continue;
    }
    // The lost frame may have emptied the mailbox: ask for the message again, until the slave
    // acknowledges by copying the toggle.
    constexpr uint16_t kActivate = reg::kSyncManager + kMailboxIn * kSyncManagerSize + 6;
    repeat_ = !repeat_;
    Write<uint8_t>(kActivate,
                   static_cast<uint8_t>(kSmEnable | (repeat_ ? kSmRepeatRequest : uint8_t{0})));
    while (((Read<uint8_t>(kActivate + 1) & kSmRepeatRequest) != 0) != repeat_) {
      if (Now() > deadline) Fail(what + ": does not repeat its lost answer");
      Pause();
    }
  }
}

}  // namespace poise::ethercat
