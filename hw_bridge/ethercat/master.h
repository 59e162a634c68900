// Master: starts a chain of CiA 402 drives and other slaves, and exchanges their process data each
// cycle.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "hw_bridge/ethercat/attendant.h"
#include "hw_bridge/ethercat/distributed_clocks.h"
#include "hw_bridge/ethercat/ethercat.pb.h"
#include "hw_bridge/ethercat/process_image.h"
#include "hw_bridge/ethercat/slave_access.h"
#include "hw_bridge/ethercat/slave_setup.h"
#include "hw_bridge/ethercat/topology.h"
#include "hw_bridge/ethercat/transactions.h"

namespace poise::ethercat {

/// The cyclic datagram: all at once, or inputs and outputs apart.
enum class Exchange : uint8_t { kReadWrite, kRead, kWrite };

/// What became of the frame of a cycle.
struct CycleResult {
  bool returned = false;  ///< false: lost, late or unusable
  /// Every slave answered: for a read, inputs() are of this cycle; else they stay those before.
  bool complete = false;
  uint16_t working_counter = 0, expected_working_counter = 0;
  uint16_t slaves_answering = 0;       ///< to the broadcast read of the AL status
  uint8_t al_status = 0;               ///< of all slaves, or-ed: 0x08 when all are in OP
  std::optional<int64_t> system_time;  ///< ns, of the reference clock, with distributed clocks
};

class Master {
 public:
  /// `link` must outlive this. Throws EthercatError: a configuration that cannot work.
  Master(Link* link, const MasterConfig& config);
  /// In place of the link that it was made with, which may have been nullptr; before Start.
  void set_link(Link* link) { transactions_.set_link(link); }

  size_t num_drives() const { return outputs_.size(); }
  /// The drives, then the others.
  size_t num_slaves() const { return slaves_.size(); }
  const ProcessImage& image() const { return image_; }

  /// Number of slaves that answer a broadcast read of the AL status; nullopt: no frame came back.
  std::optional<int> CountSlaves();
  /// Leads all slaves from whatever state to OP, with outputs of zero (no torque, 6072 = 0), and
  /// returns only when number, wiring, identity, ratings and mapping of the slaves are as
  /// configured. Process data must flow from then on, or the drives' watchdogs expire. Throws
  /// EthercatError; the slaves then stay where they are: call Stop().
  void Start();
  /// After Start: slaves are looked after while cycles go on (attendant.h).
  void Attend(bool lockstep, Attendant::Say say);
  /// nullptr: nobody looks after them.
  const Attendant* attendant() const { return attendant_.get(); }
  /// Takes all torque, disables the drives and leads all slaves to INIT. False when not all have
  /// got there.
  bool Stop();

  // Cyclic operation: nothing allocates, throws or, with a deadline in the past, waits.

  void set_outputs(size_t drive, const DriveOutputs& outputs) { outputs_[drive] = outputs; }
  const DriveOutputs& outputs(size_t drive) const { return outputs_[drive]; }
  /// The last complete read brought these.
  const DriveInputs& inputs(size_t drive) const { return inputs_[drive]; }
  /// Sends the frame of a cycle. False when the link refused it.
  bool Send(Exchange exchange = Exchange::kReadWrite);
  /// Takes the answer to the last Send, waiting until `deadline` (the link's clock) at most. Frames
  /// of earlier cycles are counted and dropped.
  CycleResult Receive(int64_t deadline);

  /// Gives access to the slave's mailbox, at any time after PRE-OP; blocks. It is for start-up and
  /// diagnosis, not while an attendant speaks with the slave.
  SlaveAccess& slave(size_t slave) { return slaves_[slave]; }
  /// A slave's place in the chain, 0 the first.
  int position(size_t slave) const { return positions_[slave]; }
  /// What a slave reports in an object, of the last complete read. `place`: from image().
  uint64_t input(const ProcessImage::Place& place) const {
    return GetBits(image_bytes_, place.bit, place.bits);
  }
  const FrameCounts& counts() const { return transactions_.counts(); }
  int64_t short_working_counters() const { return short_working_counters_; }

 private:
  int64_t Now() const { return transactions_.link()->Now(); }
  void CheckCount();
  void ResetAndAddress();
  void FindWiring();
  void FindPositions();
  void PlaceSlaves();
  /// The slaves as positions_ has them.
  void MakeSlaves();
  void SetUpDistributedClocks();
  void AwaitClocks();
  void GoOperational();
  /// Exchanges process data at the next cycle's time.
  CycleResult Pace();
  bool Take(const FrameReader& reader, CycleResult* result);
  /// Whether it is the last frame's datagram of this command, register and size.
  bool Answers(const Datagram& datagram, Command command, uint16_t ado, size_t size) const;
  /// The cyclic datagram: which part of the image, and the working counter when all take part.
  struct Cyclic {
    Command command;
    size_t begin, size;
    uint16_t working_counter;
    uint32_t address() const { return kLogicalStart + static_cast<uint32_t>(begin); }
  };
  Cyclic CyclicOf(Exchange exchange) const;

  MasterConfig config_;
  ProcessImage image_;
  SlaveSetup setup_;
  Transactions transactions_;
  Timeouts timeouts_;
  std::vector<SlaveAccess> slaves_;
  std::vector<int> positions_;      // by slave
  std::vector<SlavePlace> wiring_;  // by position
  ClockPlan clocks_;
  std::unique_ptr<Attendant> attendant_;
  std::vector<DriveOutputs> outputs_;
  std::vector<DriveInputs> inputs_;

  // The cyclic frame is made and read with these.
  std::vector<uint8_t> image_bytes_;
  FrameBuilder builder_;
  std::array<uint8_t, kMaxFrame> received_{};
  Exchange exchange_ = Exchange::kReadWrite;
  uint8_t cyclic_index_ = 0;
  bool awaited_ = false;             // sent and not yet returned
  std::optional<Datagram> acyclic_;  // the attendant's, in the frame under way
  bool operational_ = false;
  bool trouble_ = false;                   // the last frame was lost, or not all slaves were in OP
  int64_t next_cycle_ = 0;                 // ns, of Pace()
  int64_t system_time_ = 0, seen_at_ = 0;  // ns: the reference clock's, and the link's time then
  int64_t short_working_counters_ = 0;
};

}  // namespace poise::ethercat
