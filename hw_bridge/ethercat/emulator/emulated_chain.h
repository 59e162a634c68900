// EmulatedChain: drives in a line that process EtherCAT frames as they pass.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hw_bridge/ethercat/emulator/emulated_slave.h"
#include "hw_bridge/ethercat/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Faults of frames are FaultyLink's; those of slaves are the slaves' own setters, and CutAfter.
class EmulatedChain final : public FrameHandler {
 public:
  /// One load a drive, outliving this.
  EmulatedChain(const EmulatedChainConfig& config, std::span<MotorLoad* const> loads);

  void AdvanceTo(int64_t now) override;
  /// Counts by error what is no frame.
  bool HandleFrame(std::span<uint8_t> frame, int64_t now) override;

  size_t size() const { return slaves_.size(); }
  EmulatedSlave& slave(size_t i) { return *slaves_[i]; }
  /// A broken cable: frames turn back after `count` slaves.
  void CutAfter(size_t count) { connected_ = count; }

  int64_t frames() const { return frames_; }
  int64_t refused(FrameError error) const { return refused_[static_cast<size_t>(error)]; }

 private:
  /// A datagram in place, at one slave.
  void Process(const Datagram& datagram, std::span<uint8_t> bytes, EmulatedSlave* slave,
               int64_t now);
  void LatchReceiveTimes(int64_t now);

  std::vector<std::unique_ptr<EmulatedSlave>> slaves_;
  int64_t hop_;
  size_t connected_;
  int64_t frames_ = 0;
  std::array<int64_t, kNumFrameErrors> refused_{};
};

}  // namespace poise::ethercat
