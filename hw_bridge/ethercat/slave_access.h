// Registers, states, EEPROM and objects of one slave, by its configured station address.
#pragma once

#include <array>
#include <string>
#include <type_traits>

#include "hw_bridge/ethercat/bytes.h"
#include "hw_bridge/ethercat/coe.h"
#include "hw_bridge/ethercat/registers.h"
#include "hw_bridge/ethercat/transactions.h"

namespace poise::ethercat {

/// As the slave's EEPROM has it.
struct Identity {
  uint32_t vendor = 0, product = 0, revision = 0, serial = 0;
};

/// Address and size, bytes, of a mailbox in the slave's memory.
struct MailboxArea {
  uint16_t offset = 0, size = 0;
};

struct Timeouts {
  int64_t eeprom = 0, mailbox = 0, state = 0;  ///< ns
};

/// Acyclic access to one slave. Everything that fails throws EthercatError naming the slave, what
/// was asked of it and what it answered.
class SlaveAccess {
 public:
  SlaveAccess(Transactions* transactions, const Timeouts& timeouts, int position, uint16_t station)
      : transactions_(transactions), timeouts_(timeouts), position_(position), station_(station) {}

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

  /// A 32-bit value of the EEPROM at a word address.
  uint32_t ReadEeprom(uint16_t word);
  Identity ReadIdentity();
  /// Start addresses of the sync managers by number, from the EEPROM; 0 where it has none.
  std::array<uint16_t, kNumSyncManagers> ReadSyncManagerAddresses();

  struct AlStatus {
    AlState state = AlState::kInit;
    bool error = false;
    uint16_t code = 0;
  };
  AlStatus ReadAlStatus();
  /// "SAFE-OP with error 0x001B (sync manager watchdog)"
  static std::string Text(const AlStatus& status);
  /// Requests a state (acknowledging an error first) without waiting for it.
  void RequestState(AlState state);
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

  /// Prepares SDO transfers: reads where the mailboxes are from the EEPROM and sets the sync
  /// managers 0 and 1.
  void SetUpMailbox();
  /// The object's value and, when asked for, its size in bytes (1 to 4).
  uint32_t Upload(ObjectAddress object, uint8_t* size = nullptr);
  /// `size`: 1 to 4 bytes.
  void Download(ObjectAddress object, uint32_t value, uint8_t size);
  /// The last emergency message met in the mailbox; code 0: none.
  const Emergency& last_emergency() const { return emergency_; }

 private:
  int64_t Now() const { return transactions_->link()->Now(); }
  bool StateReached(AlState state, int64_t deadline);
  /// Waits until the EEPROM is not busy; the error bits it then shows.
  uint16_t AwaitEeprom(uint16_t word);
  Sdo Exchange(const Sdo& request);
  void SendMailbox(std::span<uint8_t> mailbox, int64_t deadline, const std::string& what);
  void ReceiveMailbox(std::span<uint8_t> mailbox, int64_t deadline, const std::string& what);
  [[noreturn]] void Fail(const std::string& problem) const;

  Transactions* transactions_;
  Timeouts timeouts_;
  int position_;
  uint16_t station_;
  std::string name_;
  MailboxArea out_, in_;  // as the master sees it
  uint8_t mailbox_counter_ = 0;
  uint8_t received_counter_ = 0;  // the slave's, of the last message; a repetition has the same
  bool repeat_ = false;           // the repeat request's toggle
  Emergency emergency_;
};

}  // namespace poise::ethercat
