// EmulatedSlave: slave controller, AL state machine, CoE mailbox and process data of one drive.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "hw_bridge/ethercat/emulator/emulated_drive.h"
#include "hw_bridge/ethercat/emulator/emulated_esc.h"
#include "hw_bridge/ethercat/emulator/emulator.pb.h"
#include "hw_bridge/ethercat/emulator/object_dictionary.h"

namespace poise::ethercat {

class EmulatedSlave {
 public:
  /// `last`: no slave behind. `load` must outlive this.
  EmulatedSlave(const EmulatedDriveConfig& config, bool last, MotorLoad* load);
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
  static constexpr uint8_t kMostMapped = 8;  // objects in a PDO

  /// Objects of the PDOs and their assignment to sync managers.
  void AddPdoObjects(uint16_t assign, uint16_t fixed_pdo, uint16_t user_pdo, uint8_t mappable,
                     std::initializer_list<uint32_t> fixed);
  SdoAbort CheckMapping(uint32_t mapping, uint8_t mappable) const;
  std::vector<Object*> Mapped(uint16_t assign);
  static size_t Size(const std::vector<Object*>& mapped);

  void HandleAlControl(uint16_t control);
  AlStatusCode CheckTransition(AlState state);
  void Enter(AlState state);
  void Fail(AlStatusCode code);
  void FinishTransition();
  void AnswerMailbox();
  void Reply(const Sdo& sdo);
  void ApplyOutputs();
  void UpdateInputs();

  EmulatedDriveConfig config_;
  ObjectDictionary objects_;
  EmulatedEsc esc_;
  EmulatedDrive drive_;
  int64_t now_ = 0;

  AlState state_ = AlState::kInit;
  bool error_ = false;
  std::optional<AlState> requested_;  // a way up, to be finished
  int64_t requested_at_ = 0;          // ns
  bool outputs_seen_ = false, sync0_seen_ = false;

  std::vector<Object*> outputs_, inputs_;  // as mapped when SAFE-OP was entered
  bool outputs_pending_ = false;           // written, to be applied at SYNC0

  std::optional<Sdo> request_;  // answered at reply_at_
  int64_t reply_at_ = 0;
  uint8_t request_counter_ = 0, reply_counter_ = 0;
  std::vector<uint8_t> last_reply_;
  bool silent_ = false;
};

}  // namespace poise::ethercat
