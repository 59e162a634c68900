// Links over sockets: raw Ethernet and EtherCAT over UDP.
#pragma once

#include <netinet/in.h>

#include <array>
#include <memory>
#include <string>

#include "components/framework/clock.h"
#include "components/framework/file_descriptor.h"
#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"
#include "hw_bridge/ethercat/links/link.pb.h"

namespace poise::ethercat {

/// Common to both: an owned socket and the monotonic clock.
class SocketLink : public Link {
 public:
  enum class Side { kMaster, kSlaves };

  int64_t Now() const override { return NowNanoseconds(); }
  /// Readable when a frame has come.
  int fd() const { return socket_; }

 protected:
  bool WaitReadable(int64_t deadline) const;

  FileDescriptor socket_;
};

/// EtherCAT over UDP (ETG.1000.4, 5.2.3), IPv4. Needs no privileges.
class UdpLink final : public SocketLink {
 public:
  /// A master sends to the address and takes frames from it alone; slaves listen there (port 0: any
  /// free one) and answer whoever sent last. Throws EthercatError.
  UdpLink(const UdpConfig& config, Side side);

  uint16_t local_port() const { return local_port_; }
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  sockaddr_in peer_{};
  bool peer_known_ = false;
  bool listen_;
  uint16_t local_port_ = 0;
};

/// Ethernet frames of type 0x88A4 on one network interface (AF_PACKET; needs CAP_NET_RAW).
class RawLink final : public SocketLink {
 public:
  /// A slave's side gives frames back with the addresses they came with, the locally administered
  /// bit of the source set, as an ESC does to the frames that pass it (whether it was set before or
  /// not); a master's side takes only those with its own source, with or without the bit.
  /// Throws EthercatError: no such interface, interface down, no privilege.
  RawLink(const std::string& interface, Side side);

  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  static constexpr size_t kEthernetHeader = 14;
  static constexpr size_t kMinEthernet = 60;  // without the checksum

  Side side_;
  std::array<uint8_t, kEthernetHeader + kMaxFrame> out_{};
  std::array<uint8_t, kEthernetHeader + kMaxFrame + 1> in_{};
};

/// Throws ConfigError "link...": not exactly one kind is set, or a number breaks its rule.
void CheckLink(const LinkConfig& config);

/// One side of the configured link. Throws ConfigError as CheckLink, and EthercatError: it cannot
/// be opened.
std::unique_ptr<SocketLink> OpenLink(const LinkConfig& config, SocketLink::Side side);

}  // namespace poise::ethercat
