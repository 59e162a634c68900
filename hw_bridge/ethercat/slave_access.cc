#include "hw_bridge/ethercat/slave_access.h"

#include <fmt/format.h>

#include <algorithm>

namespace poise::ethercat {
namespace {

constexpr int64_t kPause = kMillisecond / 5;  // between two looks at a register
constexpr size_t kMostObject = 64 * 1024;     // bytes that a slave may announce of one object

std::string Text(ObjectAddress object) {
  return fmt::format("object {:04X}:{:02X}", object.index, object.subindex);
}

bool IsSegmentRequest(SdoCommand command) {
  return command == SdoCommand::kUploadSegmentRequest ||
         command == SdoCommand::kDownloadSegmentRequest;
}

}  // namespace

std::string SlaveAccess::Describe() const {
  return fmt::format("slave {} (station {}{}{})", position_, station_, name_.empty() ? "" : ", ",
                     name_);
}

void SlaveAccess::Pause() {
  // Nothing is awaited: what comes is an answer that had been given up.
  std::array<uint8_t, 1> ignored;
  const int64_t until = Now() + kPause;
  while (transactions_->link()->Receive(ignored, until) != 0) {
    ++transactions_->mutable_counts()->unexpected;
  }
}

void SlaveAccess::Transfer(Command command, uint16_t address, std::span<uint8_t> data) {
  const std::string_view doing = command == Command::kFprd ? "reading" : "writing";
  const auto counter = transactions_->Execute(command, station_, address, data);
  if (!counter) Fail("{} register 0x{:04X}: no frame came back", doing, address);
  if (*counter != 1) {
    Fail("{} register 0x{:04X}: working counter {} instead of 1; is the slave still on the bus?",
         doing, address, *counter);
  }
}

void SlaveAccess::Write(uint16_t address, std::span<const uint8_t> data) {
  std::vector<uint8_t> bytes(data.begin(), data.end());
  Transfer(Command::kFpwr, address, bytes);
}

bool SlaveAccess::AssignStation() {
  std::array<uint8_t, 2> bytes{};
  Put<uint16_t>(bytes, 0, station_);
  return transactions_->Execute(Command::kApwr, AutoIncrementAddress(position_),
                                reg::kStationAddress, bytes) == 1;
}

std::optional<uint16_t> SlaveAccess::FindStation() {
  std::array<uint8_t, 2> bytes{};
  const auto counter = transactions_->Execute(Command::kAprd, AutoIncrementAddress(position_),
                                              reg::kStationAddress, bytes, 1);
  return counter == 1 ? std::optional(Get<uint16_t>(bytes, 0)) : std::nullopt;
}

bool SlaveAccess::HasClock() {
  const auto features = Read<uint8_t>(reg::kFeatures);
  return (features & kFeatureClock) != 0 && (features & kFeature64Bits) != 0;
}

SlavePorts SlaveAccess::ReadPorts() {
  SlavePorts ports{.dl_status = Read<uint16_t>(reg::kDlStatus), .has_times = HasClock()};
  for (size_t i = 0; ports.has_times && i < kNumPorts; ++i) {
    ports.times[i] = Read<uint32_t>(static_cast<uint16_t>(reg::kDcReceiveTime + 4 * i));
  }
  return ports;
}

void SlaveAccess::SetSyncManager(int manager, uint16_t start, uint16_t size, uint8_t control) {
  std::array<uint8_t, kSyncManagerSize> bytes{};
  Put<uint16_t>(bytes, 0, start);
  Put<uint16_t>(bytes, 2, size);
  bytes[4] = control;
  bytes[6] = kSmEnable;
  Write(static_cast<uint16_t>(reg::kSyncManager + manager * kSyncManagerSize), bytes);
}

uint16_t SlaveAccess::AwaitEeprom(uint16_t word) {
  const int64_t deadline = Now() + timeouts_.eeprom;
  while (true) {
    const auto status = Read<uint16_t>(reg::kEepromControl);
    if ((status & kEepromBusy) == 0) return status & kEepromErrors;
    if (Now() > deadline) Fail("EEPROM word 0x{:04X}: busy until the timeout", word);
    Pause();
  }
}

uint32_t SlaveAccess::ReadEeprom(uint16_t word) {
  if (!owns_eeprom_) {
    // Forced from the slave's application, then the master's.
    Write<uint8_t>(reg::kEepromConfig, kEepromForce);
    Write<uint8_t>(reg::kEepromConfig, kEepromMaster);
    owns_eeprom_ = true;
  }
  // Errors of an earlier command stay until a command of none clears them.
  if (AwaitEeprom(word) != 0) Write<uint16_t>(reg::kEepromControl, 0);
  Write<uint32_t>(reg::kEepromAddress, word);
  Write<uint16_t>(reg::kEepromControl, kEepromReadCommand);
  if (const uint16_t errors = AwaitEeprom(word); errors != 0) {
    Fail("EEPROM word 0x{:04X}: error bits 0x{:04X}; is the EEPROM programmed?", word, errors);
  }
  return Read<uint32_t>(reg::kEepromData);
}

Identity SlaveAccess::ReadIdentity() {
  return {.vendor = ReadEeprom(sii::kVendor),
          .product = ReadEeprom(sii::kProduct),
          .revision = ReadEeprom(sii::kRevision),
          .serial = ReadEeprom(sii::kSerial)};
}

void SlaveAccess::ReleaseEeprom() {
  Write<uint8_t>(reg::kEepromConfig, kEepromApplication);
  owns_eeprom_ = false;
}

std::optional<SlaveAccess::Category> SlaveAccess::FindCategory(uint16_t wanted) {
  constexpr uint32_t kMaxWords = 0x4000;  // of the largest EEPROM in use, 32 KiB
  for (uint32_t word = sii::kCategories; word < kMaxWords;) {
    const uint32_t header = ReadEeprom(static_cast<uint16_t>(word));
    const uint32_t type = header & 0xFFFF, words = header >> 16;
    if (type == sii::kCategoryEnd) break;
    word += 2;
    if (type == wanted) return Category{static_cast<uint16_t>(word), words};
    word += words;
  }
  return std::nullopt;
}

std::array<SyncManagerEntry, kNumSyncManagers> SlaveAccess::ReadSyncManagers() {
  std::array<SyncManagerEntry, kNumSyncManagers> managers{};
  const std::optional<Category> category = FindCategory(sii::kCategorySyncManagers);
  if (!category) return managers;
  constexpr uint32_t kEntryWords = 4;
  for (uint32_t i = 0; i < category->words / kEntryWords && i < kNumSyncManagers; ++i) {
    const auto at = static_cast<uint16_t>(category->word + kEntryWords * i);
    const uint32_t area = ReadEeprom(at), use = ReadEeprom(static_cast<uint16_t>(at + 2));
    managers[i] = {.start = static_cast<uint16_t>(area),
                   .length = static_cast<uint16_t>(area >> 16),
                   .control = static_cast<uint8_t>(use),
                   .type = static_cast<uint8_t>(use >> 24)};
  }
  return managers;
}

std::string SlaveAccess::ReadName() {
  const std::optional<Category> general = FindCategory(sii::kCategoryGeneral);
  const std::optional<Category> strings = FindCategory(sii::kCategoryStrings);
  constexpr uint32_t kNameWord = 1;  // its high byte: which of the strings
  if (!general || !strings || general->words <= kNameWord) return "";
  const uint32_t wanted = ReadEeprom(general->word) >> 24;
  uint32_t byte = 0, held = 0;
  const auto next = [&] {
    if (byte % 4 == 0) held = ReadEeprom(static_cast<uint16_t>(strings->word + byte / 2));
    const uint32_t value = held >> (8 * (byte % 4)) & 0xFF;
    ++byte;
    return value;
  };
  const uint32_t bytes = 2 * strings->words;
  const uint32_t count = bytes > 0 ? next() : 0;
  for (uint32_t i = 1; i <= count && byte < bytes; ++i) {
    std::string text;
    for (uint32_t left = next(); left > 0 && byte < bytes; --left) {
      text += static_cast<char>(next());
    }
    if (i == wanted) return text;
  }
  return "";
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

bool SlaveAccess::WriteAlControl(uint8_t control) {
  std::array<uint8_t, 2> bytes{};
  Put<uint16_t>(bytes, 0, control);
  const auto counter = transactions_->Execute(Command::kFpwr, station_, reg::kAlControl, bytes);
  if (!counter) Fail("writing AL control: no frame came back");
  return *counter == 1;
}

void SlaveAccess::RequestState(AlState state, const std::function<void()>& meanwhile) {
  const auto wanted = static_cast<uint8_t>(state);
  const int64_t deadline = Now() + timeouts_.state;
  while (true) {
    const AlStatus status = ReadAlStatus();
    // INIT may be asked for along with the acknowledgement; anything else waits for its effect.
    const bool at_once = !status.error || state == AlState::kInit;
    const auto control =
        static_cast<uint8_t>(at_once ? wanted | (status.error ? kAlError : 0)
                                     : static_cast<uint8_t>(status.state) | kAlError);
    if (at_once) {
      acknowledged_ = false;
      if (WriteAlControl(control)) return;
    } else if (!acknowledged_) {
      acknowledged_ = WriteAlControl(control);
    }
    if (Now() > deadline) {
      acknowledged_ = false;
      Fail("does not take the request for {}: it is in {}", Name(state), Text(status));
    }
    meanwhile ? meanwhile() : Pause();
  }
}

void SlaveAccess::AwaitInit() {
  // Slaves read AL control when they get to it. An error may be raised between two looks.
  constexpr int64_t kAskAgain = 100 * kMillisecond;
  const int64_t deadline = Now() + timeouts_.state;
  for (int64_t asked = Now();; Pause()) {
    const AlStatus status = ReadAlStatus();
    if (status.state == AlState::kInit && !status.error) return;
    if (Now() > deadline) {
      Fail("has not changed to INIT by the timeout: it is in {}", Text(status));
    }
    if (Now() - asked < kAskAgain) continue;
    asked = Now();
    static_cast<void>(WriteAlControl(static_cast<uint8_t>(AlState::kInit) | kAlError));
  }
}

std::optional<uint32_t> SlaveAccess::ReadIdentification() {
  const AlStatus before = ReadAlStatus();
  const auto control = static_cast<uint8_t>(before.state);
  const int64_t deadline = Now() + timeouts_.eeprom;
  while (!WriteAlControl(control | kAlIdentification)) {
    if (Now() > deadline) Fail("does not take the request for its identification");
    Pause();
  }
  std::optional<uint32_t> found;
  while (!found && Now() < deadline) {
    std::array<uint8_t, 6> bytes{};
    Read(reg::kAlStatus, bytes);
    if ((bytes[0] & kAlIdentification) != 0) found = Get<uint16_t>(bytes, 4);
    Pause();
  }
  while (!WriteAlControl(control) && Now() < deadline + timeouts_.eeprom) Pause();
  return found;
}

void SlaveAccess::AwaitState(AlState state, const std::function<void()>& meanwhile) {
  const int64_t deadline = Now() + timeouts_.state;
  while (true) {
    const AlStatus status = ReadAlStatus();
    if (status.error) Fail("does not change to {}: it is in {}", Name(state), Text(status));
    if (status.state == state) return;
    if (Now() > deadline) {
      Fail("has not changed to {} by the timeout: it is in {}", Name(state), Text(status));
    }
    meanwhile ? meanwhile() : Pause();
  }
}

bool SlaveAccess::SetUpMailbox() {
  out_ = in_ = {};
  const uint32_t out = ReadEeprom(sii::kMailboxOutOffset);
  const uint32_t in = ReadEeprom(sii::kMailboxInOffset);
  if ((ReadEeprom(sii::kMailboxProtocols) & sii::kProtocolCoe) == 0) return false;
  const MailboxArea areas[] = {
      {.offset = static_cast<uint16_t>(out), .size = static_cast<uint16_t>(out >> 16)},
      {.offset = static_cast<uint16_t>(in), .size = static_cast<uint16_t>(in >> 16)}};
  for (const MailboxArea& area : areas) {
    if (area.size < kSdoMessage || area.size > kMaxDatagramData || area.offset < reg::kRam) {
      Fail("its EEPROM gives a mailbox at 0x{:04X} of {} bytes, which cannot be", area.offset,
           area.size);
    }
  }
  out_ = areas[0];
  in_ = areas[1];
  SetSyncManager(kMailboxOut, out_.offset, out_.size, kSmMailboxOut);
  SetSyncManager(kMailboxIn, in_.offset, in_.size, kSmMailboxIn);
  repeat_ = false;
  received_counter_ = 0;
  return true;
}

uint32_t SlaveAccess::Upload(ObjectAddress object) {
  const std::vector<uint8_t> bytes = UploadBytes(object);
  if (bytes.empty() || bytes.size() > kExpedited) {
    Fail("reading {}: it has {} bytes, a number has 1 to 4", ethercat::Text(object), bytes.size());
  }
  return static_cast<uint32_t>(GetSized(bytes, 0, bytes.size()));
}

std::vector<uint8_t> SlaveAccess::UploadBytes(ObjectAddress object, bool complete) {
  const std::string what =
      fmt::format("reading {}{}", ethercat::Text(object), complete ? " with complete access" : "");
  const Sdo first = Exchange(
      {.command = SdoCommand::kUploadRequest, .object = object, .complete = complete}, what);
  const size_t total = first.total;
  if (total > kMostObject) Fail("{}: it announces {} bytes", what, total);
  std::vector<uint8_t> bytes(first.data.begin(), first.data.end());
  bool toggle = false, last = false;
  while (bytes.size() < total && !last) {
    const Sdo part = Exchange(
        {.command = SdoCommand::kUploadSegmentRequest, .object = object, .toggle = toggle}, what);
    if (part.toggle != toggle) Fail("{}: a segment came twice (toggle bit not changed)", what);
    bytes.insert(bytes.end(), part.data.begin(), part.data.end());
    last = part.last;
    toggle = !toggle;
  }
  if (bytes.size() < total) {
    Fail("{}: it ends after {} of {} bytes", what, bytes.size(), total);
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
  // An expedited transfer holds 1 to 4 bytes.
  const bool expedited = !data.empty() && data.size() <= kExpedited;
  const size_t room = out_.size > kSdoMessage ? out_.size - kSdoMessage : 0U;
  size_t done = expedited ? data.size() : std::min(data.size(), room);
  static_cast<void>(Exchange({.command = SdoCommand::kDownloadRequest,
                              .object = object,
                              .complete = complete,
                              .expedited = expedited,
                              .total = static_cast<uint32_t>(data.size()),
                              .data = data.first(done)},
                             what));
  for (bool toggle = false; done < data.size(); toggle = !toggle) {
    const size_t part = std::min(data.size() - done, out_.size - kSegmentHeader);
    const Sdo answer = Exchange({.command = SdoCommand::kDownloadSegmentRequest,
                                 .object = object,
                                 .toggle = toggle,
                                 .last = done + part == data.size(),
                                 .data = data.subspan(done, part)},
                                what);
    if (answer.toggle != toggle) Fail("{}: a segment was taken twice (toggle bit)", what);
    done += part;
  }
}

Sdo SlaveAccess::Exchange(const Sdo& request, const std::string& what) {
  if (out_.size == 0) Fail("{}: the mailbox is not set up; the slave has to be in PRE-OP", what);
  const int64_t deadline = Now() + timeouts_.mailbox;
  mailbox_counter_ = NextMailboxCounter(mailbox_counter_);
  std::vector<uint8_t> mailbox(out_.size);
  EncodeSdo(request, 0, mailbox_counter_, mailbox);
  SendMailbox(mailbox, deadline, what);
  while (true) {
    ReceiveMailbox(deadline, what);
    const std::optional<CoeMessage> message = TakeReceived(what);
    if (!message || message->service == CoeService::kSdoInformation) continue;
    const Sdo& sdo = message->sdo;
    // An answer of another object belongs to a request that had been given up; segments name no
    // object.
    const bool ours = IsSegmentRequest(request.command) || sdo.object == request.object;
    if (ours && sdo.command == SdoCommand::kAbort) {
      throw SdoAbortError(fmt::format("{}: {}: SDO abort 0x{:08X} ({})", Describe(), what,
                                      sdo.abort_code, SdoAbortText(sdo.abort_code)),
                          sdo.abort_code);
    }
    if (ours && sdo.command == ResponseTo(request.command)) return sdo;
  }
}

std::optional<CoeMessage> SlaveAccess::TakeReceived(const std::string& what) {
  const std::optional<MailboxMessage> message = DecodeMailbox(received_);
  if (!message) Fail("{}: the answer is longer than the mailbox", what);
  if (message->counter != 0 && message->counter == received_counter_) return std::nullopt;
  received_counter_ = message->counter;
  if (message->type == MailboxType::kError) {
    const auto detail =
        static_cast<uint16_t>(message->payload.size() < 4 ? 0 : Get<uint16_t>(message->payload, 2));
    Fail("{}: mailbox error 0x{:04X} ({})", what, detail, MailboxErrorText(detail));
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
    if (Now() > deadline) Fail("{}: its mailbox stays full until the timeout", what);
    if (counter) Pause();
  }
}

void SlaveAccess::ReceiveMailbox(int64_t deadline, const std::string& what) {
  received_.assign(in_.size, 0);
  while (true) {
    const auto counter = transactions_->Execute(Command::kFprd, station_, in_.offset, received_, 1);
    if (counter && *counter == 1) return;
    if (Now() > deadline) Fail("{}: no answer by the timeout", what);
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
      if (Now() > deadline) Fail("{}: does not repeat its lost answer", what);
      Pause();
    }
  }
}

}  // namespace poise::ethercat
