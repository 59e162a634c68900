// Captures of EtherCAT frames as pcap files, for Wireshark and tshark.
#pragma once

#include <fstream>
#include <memory>
#include <string>

#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Another link with every frame captured in a file of the classic pcap format with nanoseconds,
/// link type Ethernet. Allocates as its file does: not for a control loop that must not.
class CaptureLink final : public Link {
 public:
  enum class Carrier { kEthernet, kUdp };
  /// Throws EthercatError when the file cannot be created.
  CaptureLink(std::unique_ptr<Link> link, const std::string& path, Carrier carrier);
  /// Throws EthercatError when anything could not be written.
  void Close();

  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  void Write(std::span<const uint8_t> frame, bool to_slaves);
  void Check() const;

  std::unique_ptr<Link> link_;
  std::string path_;
  std::ofstream file_;
  Carrier carrier_;
};

}  // namespace poise::ethercat
