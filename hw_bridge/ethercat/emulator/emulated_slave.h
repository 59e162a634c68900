// EmulatedSlave: slave controller, AL state machine, CoE mailbox and process data of one drive, or
// of another slave.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "hw_bridge/ethercat/emulator/coe_server.h"
#include "hw_bridge/ethercat/emulator/emulated_drive.h"
#include "hw_bridge/ethercat/emulator/emulated_esc.h"
#include "hw_bridge/ethercat/emulator/emulator.pb.h"
#include "hw_bridge/ethercat/emulator/object_dictionary.h"

namespace poise::ethercat {

class EmulatedSlave {
 public:
  /// `load` must outlive this.
  EmulatedSlave(const EmulatedDriveConfig& config, MotorLoad* load);
  EmulatedSlave(const EmulatedSlave&) = delete;
  EmulatedSlave& operator=(const EmulatedSlave&) = delete;

  /// Lets time pass and answers what the master has written. `now`: ns since the start.
  void AdvanceTo(int64_t now);

  EmulatedEsc& esc() { return esc_; }
  EmulatedDrive& drive() { return drive_; }
  const EmulatedDrive& drive() const { return drive_; }
  ObjectDictionary& objects() { return objects_; }
  AlState al_state() const { return state_; }
  bool al_error() const { return error_; }
  /// A fault: frames pass without being touched, so the working counter lacks this slave.
  void SetSilent(bool silent) { silent_ = silent; }
  bool silent() const { return silent_; }

 private:
  using Object = ObjectDictionary::Object;
  static constexpr uint8_t kMostMapped = 8;    // objects in a PDO
  static constexpr uint8_t kMostAssigned = 4;  // PDOs of a sync manager

  struct Mapped {
    Object* object;  // nullptr: a gap
    size_t bit, bits;
  };
  struct ProcessData {
    std::vector<Mapped> entries;
    size_t bits = 0;
    size_t size() const { return (bits + 7) / 8; }
  };

  void AddCommonObjects();
  /// Objects of the PDOs and their assignment to sync managers.
  void AddAssignment(uint16_t assign, const std::vector<uint16_t>& assigned,
                     const std::vector<uint16_t>& allowed);
  void AddFixedPdo(uint16_t pdo, const std::vector<uint32_t>& mappings);
  void AddFreePdo(uint16_t assign, uint16_t pdo, uint8_t mappable);
  /// PDOs as configured; objects of a slave that is no drive come with them.
  void AddOwnPdos(uint16_t assign, const google::protobuf::RepeatedPtrField<MappedObject>& objects,
                  uint8_t mappable);
  uint32_t Value(uint16_t index, uint32_t subindex) const {
    return objects_.Find({index, static_cast<uint8_t>(subindex)})->value;
  }
  SdoAbort CheckMapping(uint32_t mapping, uint8_t mappable) const;
  ProcessData FindMapped(uint16_t assign);

  void HandleAlControl(uint16_t control);
  AlStatusCode CheckTransition(AlState state);
  void Enter(AlState state);
  void Fail(AlStatusCode code);
  void FinishTransition();
  void AnswerMailbox();
  void SendMailboxError(MailboxError detail);
  void SendMailbox(const std::vector<uint8_t>& message);
  void ApplyOutputs();
  void UpdateInputs();

  EmulatedDriveConfig config_;
  ObjectDictionary objects_;
  EmulatedEsc esc_;
  EmulatedDrive drive_;
  CoeServer coe_;
  int64_t now_ = 0;

  AlState state_ = AlState::kInit;
  bool error_ = false;
  std::optional<AlState> requested_;  // a way up, to be finished
  int64_t requested_at_ = 0;          // ns
  bool outputs_seen_ = false, sync0_seen_ = false;
  std::optional<int64_t> control_seen_at_;  // ns, of AL control that is not yet looked at

  ProcessData outputs_, inputs_;  // as mapped when SAFE-OP was entered
  bool outputs_pending_ = false;  // written, to be applied at SYNC0

  std::optional<std::vector<uint8_t>> request_;  // a CoE payload, answered at reply_at_
  int64_t reply_at_ = 0;
  uint8_t request_counter_ = 0, reply_counter_ = 0;
  std::deque<Emergency> emergencies_;
  std::vector<uint8_t> last_reply_;
  bool silent_ = false;
};

}  // namespace poise::ethercat
