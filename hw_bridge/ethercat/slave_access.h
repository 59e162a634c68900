// All of one slave: registers, states and EEPROM by its configured station address, and the objects
// behind its mailbox (CoE).
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "hw_bridge/ethercat/coe.h"
#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/links/link.h"
#include "hw_bridge/ethercat/registers.h"
#include "hw_bridge/ethercat/topology.h"
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

/// Address and size, bytes, of a mailbox in the slave's memory.
struct MailboxArea {
  uint16_t offset = 0, size = 0;
};

inline constexpr uint16_t kFirstStation = 1001;  ///< 0 is the address of a slave that has none

/// A slave's refusal of an SDO, by its code.
class SdoAbortError : public EthercatError {
 public:
  SdoAbortError(const std::string& what, uint32_t code) : EthercatError(what), code_(code) {}
  uint32_t code() const { return code_; }

 private:
  uint32_t code_;
};

/// Acyclic access to one slave. Everything that fails throws EthercatError naming the slave, what
/// was asked of it and what it answered.
class SlaveAccess {
 public:
  /// The slave at a place in the chain, 0 the first, whose station address follows from it.
  SlaveAccess(Transactions* transactions, const Timeouts& timeouts, int position,
              std::string name = "")
      : transactions_(transactions),
        timeouts_(timeouts),
        position_(position),
        station_(static_cast<uint16_t>(kFirstStation + position)),
        name_(std::move(name)) {}

  /// "slave 3 (station 1003, left_knee_pitch)"
  std::string Describe() const;
  uint16_t station() const { return station_; }

  void Read(uint16_t address, std::span<uint8_t> data) { Transfer(Command::kFprd, address, data); }
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

  /// Gives the slave at its place in the chain its station address. False: nobody has taken it.
  bool AssignStation();
  /// The station address of who is at its place, by one frame; nullopt: nobody answers.
  std::optional<uint16_t> FindStation();
  /// Whether it has a 64-bit distributed clock.
  bool HasClock();
  /// Where it is wired, and when the last latching write (LatchClocks) passed.
  SlavePorts ReadPorts();
  /// Switches a sync manager on. `control`: kSm*.
  void SetSyncManager(int manager, uint16_t start, uint16_t size, uint8_t control);

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
  std::optional<uint32_t> ReadIdentification();

  struct AlStatus {
    AlState state = AlState::kInit;
    bool error = false;
    uint16_t code = 0;
  };
  AlStatus ReadAlStatus();
  /// "SAFE-OP with error 0x001B (sync manager watchdog)"
  static std::string Text(const AlStatus& status);
  /// Requests a state without waiting for it. An error is acknowledged first, and the request
  /// follows once the slave has taken the acknowledgement back; `meanwhile` runs between looks,
  /// Pause where it is not given.
  void RequestState(AlState state, const std::function<void()>& meanwhile = nullptr);
  /// Waits for INIT from whatever state, for which an error from before is no obstacle.
  void AwaitInit();
  /// Waits for the state; `meanwhile` likewise. Throws with the AL status code's name when the
  /// slave refuses, or at the timeout.
  void AwaitState(AlState state, const std::function<void()>& meanwhile = nullptr);
  /// Lets a little time pass between two looks at the bus.
  void Pause();
  void ChangeState(AlState state) {
    RequestState(state);
    AwaitState(state);
  }
  /// Throws EthercatError: the slave, and a problem of fmt's pattern.
  template <class... Args>
  [[noreturn]] void Fail(fmt::format_string<Args...> problem, Args&&... args) const {
    throw EthercatError("{}: {}", Describe(), fmt::format(problem, std::forward<Args>(args)...));
  }

  /// The same slave, with all that is known of it, through other transactions.
  SlaveAccess Through(Transactions* transactions) const {
    SlaveAccess other = *this;
    other.transactions_ = transactions;
    return other;
  }
  /// Reads where the mailboxes are from the EEPROM and sets the sync managers 0 and 1. False, and
  /// nothing is set: the slave has no CoE.
  bool SetUpMailbox();
  /// The object's value, of 1 to 4 bytes, by whatever transfer the slave chooses.
  uint32_t Upload(ObjectAddress object);
  /// The object's bytes. `complete`: those of all subindices from `object.subindex` (0 or 1) on.
  std::vector<uint8_t> UploadBytes(ObjectAddress object, bool complete = false);
  /// `size`: 1 to 4 bytes.
  void Download(ObjectAddress object, uint32_t value, uint8_t size);
  /// Expedited, normal or segmented, as `data` are long. Precondition: not empty.
  void DownloadBytes(ObjectAddress object, std::span<const uint8_t> data, bool complete = false);
  /// Takes a message that waits in the mailbox, if there is one, without waiting for any.
  void PollMailbox();
  /// The last emergency message met in the mailbox; code 0: none.
  const Emergency& last_emergency() const { return emergency_; }
  int64_t emergencies() const { return emergencies_; }

 private:
  void Transfer(Command command, uint16_t address, std::span<uint8_t> data);
  int64_t Now() const { return transactions_->link()->Now(); }
  /// The first word of the EEPROM behind the header, and the number of words.
  struct Category {
    uint16_t word;
    uint32_t words;
  };
  std::optional<Category> FindCategory(uint16_t wanted);
  /// False: the slave has not yet taken what was written there before.
  bool WriteAlControl(uint8_t control);
  /// Waits until the EEPROM is not busy; the error bits it then shows.
  uint16_t AwaitEeprom(uint16_t word);

  /// Sends a request and waits for its answer, which points into received_. Throws SdoAbortError.
  Sdo Exchange(const Sdo& request, const std::string& what);
  /// What the mailbox holds, when it is CoE and new; an emergency is kept and none is returned.
  std::optional<CoeMessage> TakeReceived(const std::string& what);
  void SendMailbox(std::span<uint8_t> mailbox, int64_t deadline, const std::string& what);
  void ReceiveMailbox(int64_t deadline, const std::string& what);

  Transactions* transactions_;
  Timeouts timeouts_;
  int position_;
  uint16_t station_;
  std::string name_;
  bool owns_eeprom_ = false, acknowledged_ = false;

  MailboxArea out_, in_;  // as the master sees it
  uint8_t mailbox_counter_ = 0;
  uint8_t received_counter_ = 0;   // the slave's, of the last message; a repetition has the same
  bool repeat_ = false;            // the repeat request's toggle
  std::vector<uint8_t> received_;  // the mailbox as read last
  Emergency emergency_;
  int64_t emergencies_ = 0;
};

}  // namespace poise::ethercat
