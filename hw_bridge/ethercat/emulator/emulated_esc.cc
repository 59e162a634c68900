#include "hw_bridge/ethercat/emulator/emulated_esc.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace poise::ethercat {
namespace {

constexpr size_t kRegisters = 0x1000;
constexpr int64_t kEepromTime = 100'000;  // ns that an EEPROM word takes to be read
constexpr int kSyncManagerArea = 5;       // bytes: start, length, control

/// Counters, which a write clears, whatever is written.
bool IsCounter(size_t address) {
  return (address >= reg::kReceiveErrors && address < reg::kLostLinks + kNumPorts) ||
         address == reg::kWatchdogCounter || address == reg::kWatchdogCounter + 1U;
}

bool Overlap(size_t a, size_t a_size, size_t b, size_t b_size) {
  return a < b + b_size && b < a + a_size;
}

/// Which registers the master may write.
const std::array<bool, kRegisters>& Writable() {
  static const std::array<bool, kRegisters> table = [] {
    constexpr std::pair<size_t, size_t> kAreas[] = {
        {reg::kStationAddress, 2}, {reg::kDlControl, 4},           {reg::kAlControl, 2},
        {reg::kEventMask, 2},      {reg::kReceiveErrors, 8},       {reg::kForwardedErrors, 4},
        {reg::kUnitErrors, 2},     {reg::kLostLinks, 4},           {reg::kWatchdogDivider, 2},
        {reg::kWatchdogPdi, 2},    {reg::kWatchdogProcessData, 2}, {reg::kWatchdogCounter, 2},
        {reg::kEepromConfig, 1},   {reg::kEepromControl, 14},      {reg::kDcReceiveTime, 4},
        {reg::kDcSystemTime, 8},   {reg::kDcOffset, 12},           {reg::kDcSpeedStart, 2},
        {reg::kDcTimeFilter, 2},   {reg::kDcCyclicUnit, 2},        {reg::kDcStart, 24}};
    std::array<bool, kRegisters> result{};
    for (const auto& [first, bytes] : kAreas) std::fill_n(&result[first], bytes, true);
    std::fill_n(&result[reg::kFmmu], kNumFmmus * kFmmuSize, true);
    for (size_t i = 0; i < kNumSyncManagers; ++i) {
      const size_t base = reg::kSyncManager + i * kSyncManagerSize;
      std::fill_n(&result[base], kSyncManagerArea, true);
      result[base + 6] = true;  // activate
    }
    return result;
  }();
  return table;
}

}  // namespace

EmulatedEsc::EmulatedEsc(const EmulatedDriveConfig& config, std::vector<uint16_t> eeprom)
    : config_(config), eeprom_(std::move(eeprom)) {
  memory_[reg::kType] = 0x11;  // an ET1100's kind
  memory_[reg::kFmmuCount] = kNumFmmus;
  memory_[reg::kSyncManagerCount] = kNumSyncManagers;
  memory_[reg::kRamSize] = 8;
  memory_[reg::kPortDescriptor] = 0xFF;  // all ports are MII
  memory_[reg::kFeatures] = config.has_clock() ? kFeatureClock | kFeature64Bits : 0;
  Put<uint16_t>(memory_, reg::kStationAlias, static_cast<uint16_t>(config.alias()));
  memory_[reg::kDlControl] = 1;  // frames of other types are destroyed
  SetPorts({true, false, false, false});
  Put<uint16_t>(memory_, reg::kWatchdogDivider, 2498);
  Put<uint16_t>(memory_, reg::kWatchdogPdi, 1000);
  Put<uint16_t>(memory_, reg::kWatchdogProcessData, 1000);
  memory_[reg::kWatchdogStatus] = 1;
  Put<uint16_t>(memory_, reg::kEepromControl, kEeprom8Bytes);
  Put<uint16_t>(memory_, reg::kDcSpeedStart, 0x1000);
  memory_[reg::kDcTimeFilter] = 0x04;
  memory_[reg::kDcSpeedFilter] = 0x0C;
  SetAlStatus(static_cast<uint8_t>(AlState::kInit), AlStatusCode::kNone);
  local_ = static_cast<double>(config.clock_start());
}

void EmulatedEsc::SetPorts(const std::array<bool, kNumPorts>& linked) {
  // PDI operational; a link and communication on the open ports, loops closed elsewhere.
  uint16_t status = 0x0001;
  const auto before = Get<uint16_t>(memory_, reg::kDlStatus);
  for (size_t i = 0; i < linked.size(); ++i) {
    const auto link = static_cast<uint16_t>(1U << (4 + i));
    status |= static_cast<uint16_t>(linked[i] ? link | 0x0200U << (2 * i) : 0x0100U << (2 * i));
    if (!linked[i] && (before & link) != 0) CountUp(reg::kLostLinks + i);
  }
  Put<uint16_t>(memory_, reg::kDlStatus, status);
}

bool EmulatedEsc::HasAddress(uint16_t station) const {
  const bool alias = (memory_[reg::kAliasControl] & 1) != 0;
  return Get<uint16_t>(memory_, reg::kStationAddress) == station ||
         (alias && Get<uint16_t>(memory_, reg::kStationAlias) == station);
}

uint8_t& EmulatedEsc::SyncByte(int index, size_t offset) {
  return memory_[reg::kSyncManager + static_cast<size_t>(index) * kSyncManagerSize + offset];
}

EmulatedEsc::SyncManagerSettings EmulatedEsc::sync_manager(int index) const {
  const size_t base = reg::kSyncManager + static_cast<size_t>(index) * kSyncManagerSize;
  return {.start = Get<uint16_t>(memory_, base),
          .length = Get<uint16_t>(memory_, base + 2),
          .control = memory_[base + 4],
          .active = (memory_[base + 6] & kSmEnable) != 0};
}

void EmulatedEsc::SetOutputsDisabled(bool disabled) {
  uint8_t& pdi = SyncByte(output_manager(), 7);
  pdi = static_cast<uint8_t>((pdi & ~kSmPdiDisable) | (disabled ? kSmPdiDisable : 0));
}

std::optional<int> EmulatedEsc::FindManager(size_t address, size_t size, bool write) const {
  if (address < kRegisters) return kNoManager;  // they guard the process data RAM alone
  for (int i = 0; i < kNumSyncManagers; ++i) {
    const SyncManagerSettings sync = sync_manager(i);
    if (!sync.active || sync.length == 0 || !Overlap(address, size, sync.start, sync.length)) {
      continue;
    }
    const size_t base = reg::kSyncManager + static_cast<size_t>(i) * kSyncManagerSize;
    const bool masters = (sync.control & kSmMasterWrites) != 0;
    if ((memory_[base + 7] & kSmPdiDisable) != 0 || masters != write || address != sync.start ||
        size > sync.length) {
      return std::nullopt;
    }
    const bool full = (memory_[base + 5] & kSmStatusFull) != 0;
    if (sync.mailbox() && full == write) return std::nullopt;
    return i;
  }
  return kNoManager;
}

bool EmulatedEsc::Read(uint16_t address, std::span<uint8_t> data, int64_t now) {
  AdvanceTo(now);
  if (data.empty() || address + data.size() > kMemory) return false;
  const std::optional<int> manager = FindManager(address, data.size(), false);
  if (!manager) return false;
  if (address < kRegisters) {
    Put<int64_t>(memory_, reg::kDcSystemTime, SystemTime());
  }
  std::copy_n(memory_.begin() + address, data.size(), data.begin());
  if (*manager != kNoManager) {
    const SyncManagerSettings sync = sync_manager(*manager);
    if (sync.mailbox() && data.size() == sync.length) EmptyMailbox(*manager);
  }
  return true;
}

bool EmulatedEsc::Write(uint16_t address, std::span<const uint8_t> data, int64_t now) {
  AdvanceTo(now);
  if (data.empty() || address + data.size() > kMemory) return false;
  if (address < kRegisters) {
    return !Refuses(address, data.size()) && WriteRegisters(address, data);
  }
  const std::optional<int> manager = FindManager(address, data.size(), true);
  if (!manager) return false;
  std::copy(data.begin(), data.end(), memory_.begin() + address);
  if (*manager == kNoManager) return true;
  const SyncManagerSettings sync = sync_manager(*manager);
  if (data.size() != sync.length) return true;  // the buffer is complete with its last byte
  if (sync.mailbox()) {
    SyncByte(*manager, 5) |= kSmStatusFull;
    mailbox_written_ = mailbox_written_ || *manager == kMailboxOut;
  } else if (*manager == output_manager()) {
    outputs_written_ = true;
    if ((sync.control & kSmWatchdog) != 0) {
      watchdog_triggered_ = now;
      watchdog_running_ = true;
      watchdog_expired_ = false;
      memory_[reg::kWatchdogStatus] = 1;
    }
  }
  return true;
}

bool EmulatedEsc::Refuses(size_t address, size_t size) const {
  // AL control is a mailbox to the application: one request at a time.
  if (al_control_ && Overlap(address, size, reg::kAlControl, 2)) return true;
  // The EEPROM's interface is the application's after the hand-over.
  const bool applications = (memory_[reg::kEepromConfig] & kEepromApplication) != 0;
  if (applications && Overlap(address, size, reg::kEepromControl, 14)) return true;
  const bool clock = address >= reg::kDcReceiveTime && address < reg::kDcReceiveTime + 0x100U;
  return clock && !config_.has_clock();
}

bool EmulatedEsc::WriteRegisters(size_t address, std::span<const uint8_t> data) {
  bool any = false;
  for (size_t i = 0; i < data.size() && address + i < kRegisters; ++i) {
    const size_t at = address + i;
    if (!Writable()[at]) continue;
    // An active sync manager's area does not move.
    const int byte = static_cast<int>(at) - reg::kSyncManager, manager = byte / kSyncManagerSize;
    const bool of_area =
        byte >= 0 && manager < kNumSyncManagers && byte % kSyncManagerSize < kSyncManagerArea;
    if (of_area && sync_manager(manager).active) continue;
    any = true;
    // The system time is no memory: a write is a comparison.
    if (at >= reg::kDcReceiveTime && at < reg::kDcOffset) continue;
    memory_[at] = IsCounter(at) ? uint8_t{0} : data[i];
  }
  if (any) AfterWrite(address, data);
  return any;
}

void EmulatedEsc::AfterWrite(size_t address, std::span<const uint8_t> data) {
  const auto touches = [&](size_t first, size_t count) {
    return Overlap(address, data.size(), first, count);
  };
  if (touches(reg::kAlControl, 1)) al_control_ = Get<uint16_t>(memory_, reg::kAlControl);
  if (touches(reg::kEepromControl, 2)) {
    const auto command = Get<uint16_t>(memory_, reg::kEepromControl);
    uint16_t status = kEeprom8Bytes;
    if ((command & 0x0700) == kEepromReadCommand) {
      status |= kEepromBusy;
      eeprom_ready_ = now_ + kEepromTime;
    } else if ((command & 0x0700) != 0) {
      status |= 0x2000;  // command error: nothing but reading is known
    }
    Put<uint16_t>(memory_, reg::kEepromControl, status);
  }
  for (int i = 0; i < kNumSyncManagers; ++i) {
    const size_t base = reg::kSyncManager + static_cast<size_t>(i) * kSyncManagerSize;
    if (!touches(base + 6, 1)) continue;
    if (!sync_manager(i).active) {
      SyncByte(i, 5) = 0;
      SyncByte(i, 7) &= static_cast<uint8_t>(~kSmPdiDisable);
    }
    if (i == kMailboxIn && ((SyncByte(i, 6) ^ SyncByte(i, 7)) & kSmRepeatRequest) != 0) {
      repeat_requested_ = true;
    }
  }
  if (address == reg::kDcSystemTime && data.size() >= 4) CompareSystemTime(data);
  if (touches(reg::kDcSpeedStart, 2)) rate_ = adjustment_ = 0;
  if (touches(reg::kDcActivation, 1)) StartSync0();
}

EmulatedEsc::Access EmulatedEsc::Logical(uint32_t address, std::span<uint8_t> data, bool read,
                                         bool write, int64_t now) {
  Access access;
  const uint64_t end = uint64_t{address} + data.size();
  for (int i = 0; i < kNumFmmus; ++i) {
    const size_t base = reg::kFmmu + static_cast<size_t>(i) * kFmmuSize;
    const uint64_t start = Get<uint32_t>(memory_, base);
    const uint64_t length = Get<uint16_t>(memory_, base + 4);
    const bool whole_bytes =
        memory_[base + 6] == 0 && memory_[base + 7] == 7 && memory_[base + 10] == 0;
    if ((memory_[base + 12] & 1) == 0 || !whole_bytes || length == 0) continue;
    const uint64_t first = std::max<uint64_t>(start, address);
    const uint64_t last = std::min(start + length, end);
    if (first >= last) continue;
    const uint64_t physical = Get<uint16_t>(memory_, base + 8) + (first - start);
    if (physical >= kMemory) continue;
    const std::span<uint8_t> part = data.subspan(first - address, last - first);
    const uint8_t type = memory_[base + 11];
    if (write && (type & kFmmuWrite) != 0) {
      access.written = Write(static_cast<uint16_t>(physical), part, now) || access.written;
    }
    if (read && (type & kFmmuRead) != 0) {
      access.read = Read(static_cast<uint16_t>(physical), part, now) || access.read;
    }
  }
  return access;
}

void EmulatedEsc::AdvanceTo(int64_t now) {
  if (now > now_) {
    const double step = static_cast<double>(now - now_);
    local_ += step * (1 + config_.clock_error() * 1e-6);
    adjustment_ += step * rate_;
    now_ = now;
  }
  UpdateEeprom();
  UpdateWatchdog();
  if (next_sync0_ && SystemTime() >= *next_sync0_) {
    const uint64_t cycle = sync0_cycle();
    const uint64_t passed =
        static_cast<uint64_t>(SystemTime()) - static_cast<uint64_t>(*next_sync0_);
    sync0_pulsed_ = true;
    if (cycle > 0) {
      *next_sync0_ =
          static_cast<int64_t>(static_cast<uint64_t>(*next_sync0_) + (passed / cycle + 1) * cycle);
    } else {
      next_sync0_.reset();  // a single pulse
    }
  }
}

void EmulatedEsc::UpdateEeprom() {
  if (!eeprom_ready_ || now_ < *eeprom_ready_) return;
  eeprom_ready_.reset();
  const auto word = Get<uint32_t>(memory_, reg::kEepromAddress);
  for (size_t i = 0; i < 4; ++i) {
    const uint64_t at = uint64_t{word} + i;
    Put<uint16_t>(memory_, reg::kEepromData + 2 * i,
                  at < eeprom_.size() ? eeprom_[at] : uint16_t{0xFFFF});
  }
  Put<uint16_t>(memory_, reg::kEepromControl, kEeprom8Bytes);
}

void EmulatedEsc::UpdateWatchdog() {
  const int64_t unit = (int64_t{Get<uint16_t>(memory_, reg::kWatchdogDivider)} + 2) * 40;
  const int64_t time = unit * Get<uint16_t>(memory_, reg::kWatchdogProcessData);
  if (!watchdog_running_ || time == 0 || now_ - watchdog_triggered_ <= time) return;
  watchdog_running_ = false;
  watchdog_expired_ = true;
  memory_[reg::kWatchdogStatus] = 0;
  CountUp(reg::kWatchdogCounter);
}

void EmulatedEsc::LatchReceiveTimes(const std::array<std::optional<int64_t>, kNumPorts>& ports,
                                    int64_t unit) {
  if (!config_.has_clock()) return;
  AdvanceTo(unit);
  const double rate = 1 + config_.clock_error() * 1e-6;
  const auto local = [&](int64_t time) {
    return static_cast<int64_t>(std::llround(local_ + static_cast<double>(time - now_) * rate));
  };
  for (size_t i = 0; i < ports.size(); ++i) {
    Put<uint32_t>(memory_, reg::kDcReceiveTime + 4 * i,
                  ports[i] ? static_cast<uint32_t>(local(*ports[i])) : uint32_t{0});
  }
  Put<int64_t>(memory_, reg::kDcReceiveTimeUnit, local(unit));
}

int64_t EmulatedEsc::SystemTime() const {
  // Modulo 2^64: the master may have written any offset.
  return static_cast<int64_t>(static_cast<uint64_t>(std::llround(local_ + adjustment_)) +
                              Get<uint64_t>(memory_, reg::kDcOffset));
}

void EmulatedEsc::CompareSystemTime(std::span<const uint8_t> data) {
  // The lower half decides, as in an ESC: clocks that far apart were set up by the offset.
  const auto received = Get<uint32_t>(data, 0) + Get<uint32_t>(memory_, reg::kDcDelay);
  const auto difference = static_cast<int32_t>(static_cast<uint32_t>(SystemTime()) - received);
  const int64_t magnitude = std::min<int64_t>(std::abs(int64_t{difference}), 0x7FFFFFFF);
  Put<uint32_t>(memory_, reg::kDcDifference,
                static_cast<uint32_t>(magnitude) | (difference < 0 ? 0x80000000U : 0U));
  // A proportional-integral loop; an ESC filters more, over more frames.
  const double elapsed = std::max(1e3, static_cast<double>(now_ - compared_));
  compared_ = now_;
  adjustment_ -= 0.25 * difference;
  rate_ = std::clamp(rate_ - 0.02 * difference / elapsed, -1e-3, 1e-3);
}

void EmulatedEsc::StartSync0() {
  next_sync0_.reset();
  if (!sync0_enabled()) return;
  const auto start = Get<int64_t>(memory_, reg::kDcStart);
  // A start in the past never comes.
  if (start > SystemTime()) next_sync0_ = start;
}

void EmulatedEsc::SetAlStatus(uint8_t status, AlStatusCode code) {
  Put<uint16_t>(memory_, reg::kAlStatus, status);
  Put<uint16_t>(memory_, reg::kAlStatusCode, static_cast<uint16_t>(code));
}

std::span<uint8_t> EmulatedEsc::Buffer(int index) {
  const SyncManagerSettings sync = sync_manager(index);
  if (!sync.active || sync.start < kRegisters || sync.start + size_t{sync.length} > kMemory) {
    return {};
  }
  return std::span(memory_).subspan(sync.start, sync.length);
}

void EmulatedEsc::ClearMailboxes() {
  mailbox_written_ = repeat_requested_ = false;
  for (const int manager : {kMailboxOut, kMailboxIn}) {
    if (sync_manager(manager).mailbox()) EmptyMailbox(manager);
  }
}

std::span<const uint8_t> EmulatedEsc::TakeMailbox() {
  if (!std::exchange(mailbox_written_, false)) return {};
  EmptyMailbox(kMailboxOut);
  return Buffer(kMailboxOut);
}

std::span<uint8_t> EmulatedEsc::BeginMailboxReply() {
  if ((SyncByte(kMailboxIn, 5) & kSmStatusFull) != 0) return {};
  return Buffer(kMailboxIn);
}

void EmulatedEsc::AcknowledgeRepeat() {
  uint8_t& pdi = SyncByte(kMailboxIn, 7);
  pdi = static_cast<uint8_t>((pdi & ~kSmRepeatRequest) |
                             (SyncByte(kMailboxIn, 6) & kSmRepeatRequest));
}

}  // namespace poise::ethercat
