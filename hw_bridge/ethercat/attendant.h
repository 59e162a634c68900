// Attendant: looks after the slaves while the cycle goes on. It leads those that have left OP back
// to it and reads what each says of itself.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "hw_bridge/ethercat/links/slot_link.h"
#include "hw_bridge/ethercat/slave_setup.h"

namespace poise::ethercat {

/// What a slave has shown of late; written by the attendant's thread alone.
struct SlaveDiagnosis {
  struct Al {
    uint8_t status = 0;  ///< register 0x0130, state and 0x10 for an error
    uint16_t code = 0;   ///< register 0x0134
  };

  std::atomic<bool> online{true};       ///< it answers
  std::atomic<Al> al{Al{}};             ///< both of the same moment, by one load
  std::atomic<uint16_t> error_code{0};  ///< 603F; 0 of a slave that is no drive
  std::atomic<uint16_t> emergency{0};   ///< the last one's code
  std::atomic<int64_t> emergencies{0};
  std::atomic<int32_t> clock_difference{0};  ///< ns, register 0x092C
  std::atomic<int32_t> receive_errors{0};    ///< registers 0x0300 to 0x0307, of all ports
  std::atomic<int32_t> lost_links{0};        ///< registers 0x0310 to 0x0313, of all ports
  std::atomic<int64_t> recoveries{0};        ///< times that it was led back to OP
};

/// How clocks are kept, for slaves that come back.
struct ClockPlan {
  bool running = false;
  size_t reference = 0;         ///< slave whose time is everybody's
  std::vector<bool> has_clock;  ///< by slave
  std::vector<int32_t> delays;  ///< ns, by slave
};

/// Runs in a thread of its own, whose datagrams go in the cycle's frames. Everything it does can
/// wait: only drives' own watchdogs and the supervisor answer for safety.
class Attendant {
 public:
  using Say = std::function<void(const std::string& line)>;
  /// `slaves` as they are in OP; all others must outlive this. `lockstep`: each cycle waits until
  /// this thread waits for it, so that the same cycles give the same frames. `say`: told of slaves
  /// that leave OP and come back, from this thread.
  Attendant(const MasterConfig* config, const SlaveSetup* setup, ClockPlan clocks,
            const std::vector<SlaveAccess>& slaves, const Timeouts& timeouts, bool lockstep,
            Say say);
  /// Ends the thread.
  ~Attendant();

  // The cycle's side: none of these waits (but in lockstep) or allocates.
  SlotLink& slot() { return slot_; }
  /// A cycle begins at `now`, ns. `trouble`: not all slaves are in OP, or not all have answered.
  void BeginCycle(int64_t now, bool trouble);
  const SlaveDiagnosis& diagnosis(size_t slave) const { return diagnoses_[slave]; }

 private:
  void Run();
  void LookAt(size_t slave, int turn);
  /// Whether the slave is in OP without an error.
  bool NoteState(size_t slave);
  void NoteDetails(size_t slave, int turn);
  void Recover(size_t slave);
  /// A slave that has lost its configuration: everything from INIT on.
  void Rejoin(size_t slave);
  void RestoreClock(size_t slave);
  void StartClock(size_t slave);
  void Complain(size_t slave, const std::string& line);

  const MasterConfig* config_;
  const SlaveSetup* setup_;
  ClockPlan clocks_;
  bool lockstep_;
  Say say_;
  SlotLink slot_;
  Transactions transactions_;
  std::vector<SlaveAccess> slaves_;
  std::deque<SlaveDiagnosis> diagnoses_;
  std::vector<std::string> complaints_;  // the last line of each slave
  std::atomic<bool> trouble_{false}, ended_{false};
  std::thread thread_;
};

}  // namespace poise::ethercat
