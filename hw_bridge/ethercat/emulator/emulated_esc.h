// EmulatedEsc: an EtherCAT slave controller as its registers, memory, clock and EEPROM show it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hw_bridge/ethercat/emulator/emulator.pb.h"
#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/registers.h"

namespace poise::ethercat {

/// A subset: FMMUs map whole bytes; three-buffer sync managers show the last write at once.
class EmulatedEsc {
 public:
  /// `eeprom`: words of the SII.
  EmulatedEsc(const EmulatedDriveConfig& config, std::vector<uint16_t> eeprom);

  // The master's side. `now`: ns, when the frame passes this slave; never decreases.

  /// Physical read and write. False, and nothing happens, when the memory is not accessible: beyond
  /// its end, a sync manager's buffer in the wrong direction, full or empty, or only read-only.
  bool Read(uint16_t address, std::span<uint8_t> data, int64_t now);
  bool Write(uint16_t address, std::span<const uint8_t> data, int64_t now);
  struct Access {
    bool read = false, written = false;
  };
  /// A logical command's data through the FMMUs, in place.
  Access Logical(uint32_t address, std::span<uint8_t> data, bool read, bool write, int64_t now);
  /// The times that a broadcast write to 0x0900 latches: passing each port and the processing unit
  /// (ns, true time); a port that is not in use: nothing.
  void LatchReceiveTimes(const std::array<std::optional<int64_t>, kNumPorts>& ports, int64_t unit);
  /// Whether a station address is this slave's: the configured one, or the alias when it is in use.
  bool HasAddress(uint16_t station) const;

  // The slave application's side (PDI).

  /// Lets time pass: EEPROM, watchdog, SYNC0.
  void AdvanceTo(int64_t now);
  /// Which ports have a link. One that loses it counts it.
  void SetPorts(const std::array<bool, kNumPorts>& linked);
  /// A damaged frame has come in at a port.
  void CountReceiveError(int port) { CountUp(reg::kReceiveErrors + 2 * static_cast<size_t>(port)); }
  bool al_control_pending() const { return al_control_.has_value(); }
  /// What the master has written to AL control since the last call.
  std::optional<uint16_t> TakeAlControl() { return std::exchange(al_control_, std::nullopt); }
  void SetAlStatus(uint8_t status, AlStatusCode code);

  struct SyncManagerSettings {
    uint16_t start = 0, length = 0;
    uint8_t control = 0;
    bool active = false;
    bool mailbox() const { return (control & kSmModeMask) == kSmModeMailbox; }
  };
  SyncManagerSettings sync_manager(int index) const;
  /// Which sync managers have the process data: those after the mailboxes, unless there are none.
  int output_manager() const { return config_.mailbox() ? kProcessOut : 0; }
  int input_manager() const { return config_.mailbox() ? kProcessIn : 1; }
  /// The application's own disabling of the outputs: their memory refuses the master.
  void SetOutputsDisabled(bool disabled);

  /// Empties both mailboxes, as a slave does that leaves for INIT.
  void ClearMailboxes();
  /// A message the master has put into the mailbox, which is free again; empty: none.
  std::span<const uint8_t> TakeMailbox();
  /// Where the application puts a message for the master; empty when the mailbox is full or off.
  std::span<uint8_t> BeginMailboxReply();
  void EndMailboxReply() { SyncByte(kMailboxIn, 5) |= kSmStatusFull; }
  /// The master has asked for the last message once more; true once per request.
  bool TakeRepeatRequest() { return std::exchange(repeat_requested_, false); }
  void AcknowledgeRepeat();

  /// Buffers of the process data; empty when the sync manager is not active.
  std::span<const uint8_t> process_outputs() { return Buffer(output_manager()); }
  std::span<uint8_t> process_inputs() { return Buffer(input_manager()); }
  /// Whether the master has written all process outputs since the last call.
  bool TakeOutputsWritten() { return std::exchange(outputs_written_, false); }
  bool watchdog_expired() const { return watchdog_expired_; }
  void RestartWatchdog() { watchdog_running_ = watchdog_expired_ = false; }

  bool sync0_enabled() const { return (memory_[reg::kDcActivation] & 0x03) == 0x03; }
  uint32_t sync0_cycle() const { return Get<uint32_t>(memory_, reg::kDcSync0Cycle); }
  /// Whether SYNC0 has pulsed since the last call.
  bool TakeSync0() { return std::exchange(sync0_pulsed_, false); }
  /// System time, ns, of the next pulse; nullopt: none.
  std::optional<int64_t> next_sync0() const { return next_sync0_; }
  /// ns, this slave's copy of the common time.
  int64_t SystemTime() const;

 private:
  static constexpr size_t kMemory = 0x3000;  // registers, then 8 KiB of process data RAM

  static constexpr int kNoManager = -1;
  /// The sync manager whose buffer the master accesses, or kNoManager; nullopt: it is refused.
  std::optional<int> FindManager(size_t address, size_t size, bool write) const;
  std::span<uint8_t> Buffer(int index);
  void CountUp(size_t address) {
    if (memory_[address] < 0xFF) ++memory_[address];
  }
  uint8_t& SyncByte(int index, size_t offset);
  void EmptyMailbox(int index) { SyncByte(index, 5) &= static_cast<uint8_t>(~kSmStatusFull); }
  bool Refuses(size_t address, size_t size) const;
  bool WriteRegisters(size_t address, std::span<const uint8_t> data);
  void AfterWrite(size_t address, std::span<const uint8_t> data);
  void UpdateEeprom();
  void UpdateWatchdog();
  void CompareSystemTime(std::span<const uint8_t> data);
  void StartSync0();

  EmulatedDriveConfig config_;
  std::vector<uint16_t> eeprom_;
  std::array<uint8_t, kMemory> memory_{};
  int64_t now_ = 0;  // ns, true time
  std::optional<uint16_t> al_control_;
  bool mailbox_written_ = false, repeat_requested_ = false, outputs_written_ = false;
  std::optional<int64_t> eeprom_ready_;  // ns
  int64_t watchdog_triggered_ = 0;       // ns
  bool watchdog_running_ = false, watchdog_expired_ = false;

  // The clock: true time × (1 + error), plus what drift compensation has added.
  double local_ = 0, adjustment_ = 0, rate_ = 0;
  int64_t compared_ = 0;               // ns, true time of the last comparison
  std::optional<int64_t> next_sync0_;  // ns, system time
  bool sync0_pulsed_ = false;
};

}  // namespace poise::ethercat
