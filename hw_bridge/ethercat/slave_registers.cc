#include "hw_bridge/ethercat/slave_registers.h"

#include <fmt/format.h>

#include <vector>

namespace poise::ethercat {
namespace {

constexpr int64_t kPause = kMillisecond / 5;  // between two looks at a register

}  // namespace

std::string SlaveRegisters::Describe() const {
  return fmt::format("slave {} (station {}{}{})", position_, station_, name_.empty() ? "" : ", ",
                     name_);
}

void SlaveRegisters::Fail(const std::string& problem) const {
  throw EthercatError(fmt::format("{}: {}", Describe(), problem));
}

void SlaveRegisters::Pause() {
  // Nothing is awaited: what comes is an answer that had been given up.
  std::array<uint8_t, 1> ignored;
  const int64_t until = Now() + kPause;
  while (transactions_->link()->Receive(ignored, until) != 0) {
    ++transactions_->mutable_counts()->unexpected;
  }
}

void SlaveRegisters::Read(uint16_t address, std::span<uint8_t> data) {
  const auto counter = transactions_->Execute(Command::kFprd, station_, address, data);
  if (!counter) Fail(fmt::format("reading register 0x{:04X}: no frame came back", address));
  if (*counter != 1) {
    Fail(
        fmt::format("reading register 0x{:04X}: working counter {} instead of 1; is the slave "
                    "still on the bus?",
                    address, *counter));
  }
}

void SlaveRegisters::Write(uint16_t address, std::span<const uint8_t> data) {
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

uint16_t SlaveRegisters::AwaitEeprom(uint16_t word) {
  const int64_t deadline = Now() + timeouts_.eeprom;
  while (true) {
    const auto status = Read<uint16_t>(reg::kEepromControl);
    if ((status & kEepromBusy) == 0) return status & kEepromErrors;
    if (Now() > deadline) Fail(fmt::format("EEPROM word 0x{:04X}: busy until the timeout", word));
    Pause();
  }
}

uint32_t SlaveRegisters::ReadEeprom(uint16_t word) {
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
    Fail(fmt::format("EEPROM word 0x{:04X}: error bits 0x{:04X}; is the EEPROM programmed?", word,
                     errors));
  }
  return Read<uint32_t>(reg::kEepromData);
}

Identity SlaveRegisters::ReadIdentity() {
  return {.vendor = ReadEeprom(sii::kVendor),
          .product = ReadEeprom(sii::kProduct),
          .revision = ReadEeprom(sii::kRevision),
          .serial = ReadEeprom(sii::kSerial)};
}

void SlaveRegisters::ReleaseEeprom() {
  Write<uint8_t>(reg::kEepromConfig, kEepromApplication);
  owns_eeprom_ = false;
}

std::optional<SlaveRegisters::Category> SlaveRegisters::FindCategory(uint16_t wanted) {
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

std::array<SyncManagerEntry, kNumSyncManagers> SlaveRegisters::ReadSyncManagers() {
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

std::string SlaveRegisters::ReadName() {
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

SlaveRegisters::AlStatus SlaveRegisters::ReadAlStatus() {
  std::array<uint8_t, 6> bytes{};  // status, two reserved bytes, status code
  Read(reg::kAlStatus, bytes);
  return {.state = static_cast<AlState>(bytes[0] & kAlStateMask),
          .error = (bytes[0] & kAlError) != 0,
          .code = Get<uint16_t>(bytes, 4)};
}

std::string SlaveRegisters::Text(const AlStatus& status) {
  std::string text(Name(status.state));
  if (status.error) {
    text += fmt::format(" with error 0x{:04X} ({})", status.code, AlStatusText(status.code));
  }
  return text;
}

bool SlaveRegisters::WriteAlControl(uint8_t control) {
  std::array<uint8_t, 2> bytes{};
  Put<uint16_t>(bytes, 0, control);
  const auto counter = transactions_->Execute(Command::kFpwr, station_, reg::kAlControl, bytes);
  if (!counter) Fail("writing AL control: no frame came back");
  return *counter == 1;
}

bool SlaveRegisters::TryRequest(AlState state, int64_t deadline) {
  const AlStatus status = ReadAlStatus();
  const auto wanted = static_cast<uint8_t>(state);
  // INIT may be asked for along with the acknowledgement; anything else waits for its effect.
  const bool at_once = !status.error || state == AlState::kInit;
  const auto control =
      static_cast<uint8_t>(at_once ? wanted | (status.error ? kAlError : 0)
                                   : static_cast<uint8_t>(status.state) | kAlError);
  if (at_once) {
    acknowledged_ = false;
    if (WriteAlControl(control)) return true;
  } else if (!acknowledged_) {
    acknowledged_ = WriteAlControl(control);
  }
  if (Now() > deadline) {
    acknowledged_ = false;
    Fail(fmt::format("does not take the request for {}: it is in {}", Name(state), Text(status)));
  }
  return false;
}

void SlaveRegisters::AwaitInit() {
  // Slaves read AL control when they get to it. An error may be raised between two looks.
  constexpr int64_t kAskAgain = 100 * kMillisecond;
  const int64_t deadline = Now() + timeouts_.state;
  for (int64_t asked = Now();; Pause()) {
    const AlStatus status = ReadAlStatus();
    if (status.state == AlState::kInit && !status.error) return;
    if (Now() > deadline) {
      Fail(fmt::format("has not changed to INIT by the timeout: it is in {}", Text(status)));
    }
    if (Now() - asked < kAskAgain) continue;
    asked = Now();
    static_cast<void>(WriteAlControl(static_cast<uint8_t>(AlState::kInit) | kAlError));
  }
}

std::optional<uint16_t> SlaveRegisters::ReadIdentification() {
  const AlStatus before = ReadAlStatus();
  const auto control = static_cast<uint8_t>(before.state);
  const int64_t deadline = Now() + timeouts_.eeprom;
  while (!WriteAlControl(control | kAlIdentification)) {
    if (Now() > deadline) Fail("does not take the request for its identification");
    Pause();
  }
  std::optional<uint16_t> found;
  while (!found && Now() < deadline) {
    std::array<uint8_t, 6> bytes{};
    Read(reg::kAlStatus, bytes);
    if ((bytes[0] & kAlIdentification) != 0) found = Get<uint16_t>(bytes, 4);
    Pause();
  }
  while (!WriteAlControl(control) && Now() < deadline + timeouts_.eeprom) Pause();
  return found;
}

bool SlaveRegisters::StateReached(AlState state, int64_t deadline) {
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

}  // namespace poise::ethercat
