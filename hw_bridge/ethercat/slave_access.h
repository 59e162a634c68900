// All of one slave: registers, states, EEPROM, and the objects behind its mailbox (CoE).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hw_bridge/ethercat/coe.h"
#include "hw_bridge/ethercat/slave_registers.h"

namespace poise::ethercat {

/// Address and size, bytes, of a mailbox in the slave's memory.
struct MailboxArea {
  uint16_t offset = 0, size = 0;
};

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
class SlaveAccess : public SlaveRegisters {
 public:
  using SlaveRegisters::SlaveRegisters;

  /// The same slave, with all that is known of it, through other transactions.
  SlaveAccess Through(Transactions* transactions) const {
    SlaveAccess other = *this;
    other.transactions_ = transactions;
    return other;
  }
  /// Reads where the mailboxes are from the EEPROM and sets the sync managers 0 and 1. False, and
  /// nothing is set: the slave has no CoE.
  bool SetUpMailbox();
  /// The object's value and, when asked for, its size in bytes (1 to 4), by whatever transfer the
  /// slave chooses.
  uint32_t Upload(ObjectAddress object, uint8_t* size = nullptr);
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
  /// Sends a request and waits for its answer, which points into received_. Throws SdoAbortError.
  Sdo Exchange(const Sdo& request, const std::string& what);
  /// The next CoE message that is no emergency, which is kept.
  CoeMessage ReceiveCoe(int64_t deadline, const std::string& what);
  /// What the mailbox holds, when it is CoE and new; an emergency is kept and none is returned.
  std::optional<CoeMessage> TakeReceived(const std::string& what);
  void SendMailbox(std::span<uint8_t> mailbox, int64_t deadline, const std::string& what);
  void ReceiveMailbox(int64_t deadline, const std::string& what);

  MailboxArea out_, in_;  // as the master sees it
  uint8_t mailbox_counter_ = 0;
  uint8_t received_counter_ = 0;   // the slave's, of the last message; a repetition has the same
  bool repeat_ = false;            // the repeat request's toggle
  std::vector<uint8_t> received_;  // the mailbox as read last
  Emergency emergency_;
  int64_t emergencies_ = 0;
};

}  // namespace poise::ethercat
