// Captures of EtherCAT frames as pcap files, for Wireshark and tshark.
#pragma once

#include <fstream>
#include <string>

#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Writes the classic pcap format with nanoseconds, link type Ethernet.
class PcapWriter {
 public:
  enum class Carrier { kEthernet, kUdp };
  /// Throws EthercatError when the file cannot be created.
  PcapWriter(const std::string& path, Carrier carrier);

  /// `time`: ns since any epoch, ≥ 0. `to_slaves`: the direction.
  void Write(std::span<const uint8_t> frame, int64_t time, bool to_slaves);
  /// Throws EthercatError when anything could not be written.
  void Close();

 private:
  std::string path_;
  std::ofstream file_;
  Carrier carrier_;
};

/// Another link with every frame captured. Allocates as its file does: not for a control loop that
/// must not.
class CaptureLink final : public Link {
 public:
  /// Both must outlive this.
  CaptureLink(Link* link, PcapWriter* writer) : link_(link), writer_(writer) {}

  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  Link* link_;
  PcapWriter* writer_;
};

}  // namespace poise::ethercat
