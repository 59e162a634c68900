// EmulatedChain: drives and other slaves that process EtherCAT frames as they pass.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hw_bridge/ethercat/emulator/emulated_slave.h"
#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Faults of frames are FaultyLink's; those of slaves are the slaves' own setters, and CutAfter.
class EmulatedChain final : public FrameHandler {
 public:
  /// One load a slave, outliving this; those of slaves that are no drives stay untouched. Throws
  /// EthercatError: a slave that hangs at one behind it, or two at one port.
  EmulatedChain(const EmulatedChainConfig& config, std::span<MotorLoad* const> loads);

  void AdvanceTo(int64_t now) override;
  /// Counts what is no frame.
  bool HandleFrame(std::span<uint8_t> frame, int64_t now) override;

  size_t size() const { return slaves_.size(); }
  EmulatedSlave& slave(size_t i) { return *slaves_[i]; }
  /// A broken cable: frames turn back after `count` slaves (size(): the cable is whole again).
  void CutAfter(size_t count);
  /// Power off and on again, of one slave: its registers and objects are those of its first start.
  /// Until it is on again the chain ends before it.
  void PowerOff(size_t slave);
  void PowerOn(size_t slave);
  /// Makes another product of what is switched on next at this place.
  void ChangeDevice(size_t slave, uint32_t product_code) {
    config_.mutable_drive(static_cast<int>(slave))->set_product_code(product_code);
  }

  int64_t frames() const { return frames_; }
  int64_t refused() const { return refused_; }

 private:
  void Process(const Datagram& datagram, std::span<uint8_t> bytes, EmulatedSlave* slave,
               int64_t now);
  void LatchReceiveTimes(int64_t now);
  /// Finds where a frame goes, and when, from `slave` on, which it reaches at `arrival`, ns.
  /// Returns when it is back.
  int64_t Walk(size_t slave, int64_t arrival);
  void FindWay();
  std::unique_ptr<EmulatedSlave> MakeSlave(size_t slave) const;

  struct Visit {
    size_t slave;
    int64_t time;  // ns after the frame's start, at the processing unit
  };
  EmulatedChainConfig config_;
  std::vector<MotorLoad*> loads_;
  std::vector<std::array<int, kNumPorts>> behind_;  // slave at each port; -1: none
  std::vector<Visit> way_;
  std::vector<std::array<std::optional<int64_t>, kNumPorts>> port_times_;  // ns after the start
  int64_t now_ = 0;
  std::vector<std::unique_ptr<EmulatedSlave>> slaves_;
  size_t connected_;
  int64_t frames_ = 0, refused_ = 0;
};

}  // namespace poise::ethercat
