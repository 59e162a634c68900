#include "hw_bridge/ethercat/slave_access.h"

#include <fmt/format.h>

#include <vector>

namespace poise::ethercat {
namespace {

constexpr int64_t kPause = kMillisecond / 5;  // between two looks at a register

std::string Text(ObjectAddress object) {
  return fmt::format("object {:04X}:{:02X}", object.index, object.subindex);
}

}  // namespace

std::string SlaveAccess::Describe() const {
  return fmt::format("slave {} (station {}{}{})", position_, station_, name_.empty() ? "" : ", ",
                     name_);
}

void SlaveAccess::Fail(const std::string& problem) const {
  throw EthercatError(fmt::format("{}: {}", Describe(), problem));
}

void SlaveAccess::Pause() {
  // Nothing is awaited: what comes is an answer that had been given up.
  std::array<uint8_t, 1> ignored;
  const int64_t until = Now() + kPause;
  while (transactions_->link()->Receive(ignored, until) != 0) {
    ++transactions_->mutable_counts()->unexpected;
  }
}

void SlaveAccess::Read(uint16_t address, std::span<uint8_t> data) {
  const auto counter = transactions_->Execute(Command::kFprd, station_, address, data);
  if (!counter) Fail(fmt::format("reading register 0x{:04X}: no frame came back", address));
  if (*counter != 1) {
    Fail(
        fmt::format("reading register 0x{:04X}: working counter {} instead of 1; is the slave "
                    "still on the bus?",
                    address, *counter));
  }
}

void SlaveAccess::Write(uint16_t address, std::span<const uint8_t> data) {
  std::vector<uint8_t> bytes(data.begin(), data.end());
  const auto counter = transactions_->Execute(Command::kFpwr, station_, address, bytes);
  if (!counter) Fail(fmt::format("writing register 0x{:04X}: no frame came back", address));
  if (*counter != 1) {
    Fail(
        fmt::format("writing register 0x{:04X}: working counter {} instead of 1; is the slave "
                    "still on the bus?",
                    address, *counter));
  }
}

uint16_t SlaveAccess::AwaitEeprom(uint16_t word) {
  const int64_t deadline = Now() + timeouts_.eeprom;
  while (true) {
    const auto status = Read<uint16_t>(reg::kEepromControl);
    if ((status & kEepromBusy) == 0) return status & kEepromErrors;
    if (Now() > deadline) Fail(fmt::format("EEPROM word 0x{:04X}: busy until the timeout", word));
    Pause();
  }
}

uint32_t SlaveAccess::ReadEeprom(uint16_t word) {
  Write<uint8_t>(reg::kEepromConfig, 0);  // the master's, not the slave application's
  // Errors of an earlier command stay until a command of none clears them.
  if (AwaitEeprom(word) != 0) Write<uint16_t>(reg::kEepromControl, 0);
  Write<uint32_t>(reg::kEepromAddress, word);
  Write<uint16_t>(reg::kEepromControl, kEepromReadCommand);
  if (const uint16_t errors = AwaitEeprom(word); errors != 0) {
    Fail(fmt::format("EEPROM word 0x{:04X}: error bits 0x{:04X}; is the EEPROM programmed?", word,
                     errors));
  }
  return Read<uint32_t>(reg::kEepromData);
}

Identity SlaveAccess::ReadIdentity() {
  return {.vendor = ReadEeprom(sii::kVendor),
          .product = ReadEeprom(sii::kProduct),
          .revision = ReadEeprom(sii::kRevision),
          .serial = ReadEeprom(sii::kSerial)};
}

std::array<uint16_t, kNumSyncManagers> SlaveAccess::ReadSyncManagerAddresses() {
  std::array<uint16_t, kNumSyncManagers> addresses{};
  constexpr uint32_t kMaxWords = 0x4000;  // of the largest EEPROM in use, 32 KiB
  for (uint32_t word = sii::kCategories; word < kMaxWords;) {
    const uint32_t header = ReadEeprom(static_cast<uint16_t>(word));
    const uint32_t type = header & 0xFFFF, words = header >> 16;
    if (type == sii::kCategoryEnd) break;
    if (type == sii::kCategorySyncManagers) {
      constexpr uint32_t kEntryWords = 4;
      for (uint32_t i = 0; i < words / kEntryWords && i < kNumSyncManagers; ++i) {
        addresses[i] = static_cast<uint16_t>(
            ReadEeprom(static_cast<uint16_t>(word + 2 + kEntryWords * i)) & 0xFFFF);
      }
      break;
    }
    word += 2 + words;
  }
  return addresses;
}

SlaveAccess::AlStatus SlaveAccess::ReadAlStatus() {
  std::array<uint8_t, 6> bytes{};  // status, two reserved bytes, status code
  Read(reg::kAlStatus, bytes);
  return {.state = static_cast<AlState>(bytes[0] & kAlStateMask),
          .error = (bytes[0] & kAlError) != 0,
          .code = Get<uint16_t>(bytes, 4)};
}

std::string SlaveAccess::Text(const AlStatus& status) {
  std::string text(Name(status.state));
  if (status.error) {
    text += fmt::format(" with error 0x{:04X} ({})", status.code, AlStatusText(status.code));
  }
  return text;
}

void SlaveAccess::RequestState(AlState state) {
  const AlStatus status = ReadAlStatus();
  if (status.error) {
    Write<uint16_t>(reg::kAlControl,
                    static_cast<uint16_t>(static_cast<uint8_t>(status.state) | kAlError));
  }
  Write<uint16_t>(reg::kAlControl, static_cast<uint16_t>(state));
}

bool SlaveAccess::StateReached(AlState state, int64_t deadline) {
  const AlStatus status = ReadAlStatus();
  if (status.error) {
    Fail(fmt::format("does not change to {}: it is in {}", Name(state), Text(status)));
  }
  if (status.state == state) return true;
  if (Now() > deadline) {
    Fail(fmt::format("has not changed to {} by the timeout: it is in {}", Name(state),
                     Text(status)));
  }
  return false;
}

void SlaveAccess::SetUpMailbox() {
  const uint32_t out = ReadEeprom(sii::kMailboxOutOffset);
  const uint32_t in = ReadEeprom(sii::kMailboxInOffset);
  out_ = {.offset = static_cast<uint16_t>(out), .size = static_cast<uint16_t>(out >> 16)};
  in_ = {.offset = static_cast<uint16_t>(in), .size = static_cast<uint16_t>(in >> 16)};
  if ((ReadEeprom(sii::kMailboxProtocols) & sii::kProtocolCoe) == 0) {
    Fail("its EEPROM offers no CoE mailbox; a drive of CiA 402 has one");
  }
  for (const MailboxArea& area : {out_, in_}) {
    if (area.size < kSdoMessage || area.size > kMaxDatagramData || area.offset < reg::kRam) {
      Fail(fmt::format("its EEPROM gives a mailbox at 0x{:04X} of {} bytes, which cannot be",
                       area.offset, area.size));
    }
  }
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
}

uint32_t SlaveAccess::Upload(ObjectAddress object, uint8_t* size) {
  const Sdo answer = Exchange({.command = SdoCommand::kUploadRequest, .object = object});
  if (answer.command != SdoCommand::kUploadResponse) {
    Fail(fmt::format("reading {}: it is no object of up to 4 bytes", ethercat::Text(object)));
  }
  if (size != nullptr) *size = answer.size;
  return answer.value;
}

void SlaveAccess::Download(ObjectAddress object, uint32_t value, uint8_t size) {
  const Sdo answer = Exchange(
      {.command = SdoCommand::kDownloadRequest, .object = object, .value = value, .size = size});
  if (answer.command != SdoCommand::kDownloadResponse) {
    Fail(fmt::format("writing {}: the answer is no confirmation", ethercat::Text(object)));
  }
}

Sdo SlaveAccess::Exchange(const Sdo& request) {
  const bool reading = request.command == SdoCommand::kUploadRequest;
  const std::string what =
      fmt::format("{} {}", reading ? "reading" : "writing", ethercat::Text(request.object));
  if (out_.size == 0) Fail(what + ": the mailbox is not set up; the slave has to be in PRE-OP");
  const int64_t deadline = Now() + timeouts_.mailbox;
  mailbox_counter_ = NextMailboxCounter(mailbox_counter_);
  std::vector<uint8_t> mailbox(out_.size);
  EncodeSdo(request, CoeService::kSdoRequest, 0, mailbox_counter_, mailbox);
  SendMailbox(mailbox, deadline, what);

  mailbox.resize(in_.size);
  while (true) {
    ReceiveMailbox(mailbox, deadline, what);
    const std::optional<MailboxMessage> message = DecodeMailbox(mailbox);
    if (!message) Fail(what + ": the answer is longer than the mailbox");
    if (message->counter != 0 && message->counter == received_counter_) continue;
    received_counter_ = message->counter;
    if (message->type == MailboxType::kError) {
      Fail(fmt::format("{}: mailbox error 0x{:04X}", what,
                       message->payload.size() < 4 ? 0 : Get<uint16_t>(message->payload, 2)));
    }
    if (message->type != MailboxType::kCoe) continue;
    const std::optional<CoeMessage> coe = DecodeCoe(message->payload);
    if (!coe || coe->service == CoeService::kSdoRequest) continue;
    if (coe->service == CoeService::kEmergency) {
      emergency_ = coe->emergency;
      continue;
    }
    if (coe->sdo.object != request.object) continue;  // the answer to what had been given up
    if (coe->sdo.command == SdoCommand::kAbort) {
      Fail(fmt::format("{}: SDO abort 0x{:08X} ({})", what, coe->sdo.value,
                       SdoAbortText(coe->sdo.value)));
    }
    return coe->sdo;
  }
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

void SlaveAccess::ReceiveMailbox(std::span<uint8_t> mailbox, int64_t deadline,
                                 const std::string& what) {
  while (true) {
    const auto counter = transactions_->Execute(Command::kFprd, station_, in_.offset, mailbox, 1);
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
