// Registers, states and EEPROM of one slave, by its configured station address.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <type_traits>

#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/links/link.h"
#include "hw_bridge/ethercat/registers.h"
#include "hw_bridge/ethercat/transactions.h"

namespace poise::ethercat {

/// What a slave's EEPROM says that it is.
struct Identity {
  uint32_t vendor = 0, product = 0, revision = 0, serial = 0;
};

/// A sync manager as the EEPROM's category 41 has it.
struct SyncManagerEntry {
  uint16_t start = 0, length = 0;
  uint8_t control = 0;
  uint8_t type = 0;  ///< 1, 2: mailbox out, in; 3, 4: process data out, in; 0: not used or not said
};

struct Timeouts {
  int64_t eeprom = 0, mailbox = 0, state = 0;  ///< ns
};

/// What a slave answers for without a mailbox. Everything that fails throws EthercatError naming
/// the slave, what was asked of it and what it answered.
class SlaveRegisters {
 public:
  SlaveRegisters(Transactions* transactions, const Timeouts& timeouts, int position,
                 uint16_t station)
      : transactions_(transactions), timeouts_(timeouts), station_(station), position_(position) {}

  void set_name(std::string name) { name_ = std::move(name); }
  /// "slave 3 (station 1003, left_knee_pitch)"
  std::string Describe() const;
  uint16_t station() const { return station_; }

  void Read(uint16_t address, std::span<uint8_t> data);
  void Write(uint16_t address, std::span<const uint8_t> data);
  template <class T>
  T Read(uint16_t address) {
    std::array<uint8_t, sizeof(T)> bytes{};
    Read(address, bytes);
    return Get<T>(bytes, 0);
  }
  template <class T>
  void Write(uint16_t address, std::type_identity_t<T> value) {
    std::array<uint8_t, sizeof(T)> bytes{};
    Put<T>(bytes, 0, value);
    Write(address, bytes);
  }

  /// A 32-bit value of the EEPROM at a word address. Takes the EEPROM from the slave's application.
  uint32_t ReadEeprom(uint16_t word);
  /// Hands the EEPROM over to the slave's application, which may need it on its way to PRE-OP.
  void ReleaseEeprom();
  Identity ReadIdentity();
  /// The device's name in the EEPROM, as it stands there; empty: it has none.
  std::string ReadName();
  /// By number, from the EEPROM; all zero where it has none.
  std::array<SyncManagerEntry, kNumSyncManagers> ReadSyncManagers();
  /// The number that the slave gives when it is asked for its identification (ETG.1020: AL control
  /// bit 5, answered in the AL status code); nullopt: it has none. In INIT or PRE-OP.
  std::optional<uint16_t> ReadIdentification();

  struct AlStatus {
    AlState state = AlState::kInit;
    bool error = false;
    uint16_t code = 0;
  };
  AlStatus ReadAlStatus();
  /// "SAFE-OP with error 0x001B (sync manager watchdog)"
  static std::string Text(const AlStatus& status);
  /// Requests a state without waiting for it. An error is acknowledged first, and the request
  /// follows once the slave has taken the acknowledgement back; `meanwhile` runs between looks.
  template <class Meanwhile>
  void RequestState(AlState state, Meanwhile meanwhile) {
    const int64_t deadline = Now() + timeouts_.state;
    while (!TryRequest(state, deadline)) meanwhile();
  }
  void RequestState(AlState state) {
    RequestState(state, [this] { Pause(); });
  }
  /// Waits for INIT from whatever state, for which an error from before is no obstacle.
  void AwaitInit();
  /// Waits for the state; `meanwhile` runs between looks. Throws with the AL status code's name
  /// when the slave refuses, or at the timeout.
  template <class Meanwhile>
  void AwaitState(AlState state, Meanwhile meanwhile) {
    const int64_t deadline = Now() + timeouts_.state;
    while (!StateReached(state, deadline)) meanwhile();
  }
  /// Lets a little time pass between two looks at the bus.
  void Pause();
  void ChangeState(AlState state) {
    RequestState(state);
    AwaitState(state, [this] { Pause(); });
  }

 protected:
  int64_t Now() const { return transactions_->link()->Now(); }
  [[noreturn]] void Fail(const std::string& problem) const;

  Transactions* transactions_;
  Timeouts timeouts_;
  uint16_t station_;

 private:
  /// The first word of the EEPROM behind the header, and the number of words.
  struct Category {
    uint16_t word;
    uint32_t words;
  };
  std::optional<Category> FindCategory(uint16_t wanted);
  bool StateReached(AlState state, int64_t deadline);
  bool TryRequest(AlState state, int64_t deadline);
  /// False: the slave has not yet taken what was written there before.
  bool WriteAlControl(uint8_t control);
  /// Waits until the EEPROM is not busy; the error bits it then shows.
  uint16_t AwaitEeprom(uint16_t word);

  int position_;
  std::string name_;
  bool owns_eeprom_ = false, acknowledged_ = false;
};

}  // namespace poise::ethercat
