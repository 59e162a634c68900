#include "hw_bridge/ethercat/links/socket_link.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "components/framework/configuration/config_error.h"
#include "components/framework/configuration/field_rules.h"

namespace poise::ethercat {
namespace {

constexpr uint8_t kLocallyAdministered = 0x02;

sockaddr_in Address(const UdpConfig& config) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(config.port()));
  if (inet_pton(AF_INET, config.address().c_str(), &address.sin_addr) != 1) {
    throw EthercatError("EtherCAT over UDP: \"{}\" is no IPv4 address; give four numbers with dots",
                        config.address());
  }
  return address;
}

}  // namespace

bool SocketLink::WaitReadable(int64_t deadline) const {
  while (true) {
    const int64_t left = std::max<int64_t>(deadline - Now(), 0);
    const timespec wait{.tv_sec = left / kSecond, .tv_nsec = left % kSecond};
    pollfd descriptor{.fd = socket_, .events = POLLIN, .revents = 0};
    const int ready = ppoll(&descriptor, 1, &wait, nullptr);
    if (ready >= 0) return ready > 0;
    if (errno != EINTR || left == 0) return false;
  }
}

UdpLink::UdpLink(const UdpConfig& config, Side side) : listen_(side == Side::kSlaves) {
  const sockaddr_in address = Address(config);
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const auto* raw = reinterpret_cast<const sockaddr*>(&address);
  const int result = socket_ < 0 ? -1
                     : listen_   ? bind(socket_, raw, sizeof(address))
                                 : connect(socket_, raw, sizeof(address));
  if (result != 0) {
    const int error = errno;  // ~SocketLink closes the socket
    throw EthercatError("EtherCAT over UDP: cannot {} {}:{}: {}{}", listen_ ? "listen at" : "reach",
                        config.address(), config.port(), std::strerror(error),
                        error == EADDRINUSE ? "; give another port" : "");
  }
  sockaddr_in local{};
  socklen_t size = sizeof(local);
  getsockname(socket_, reinterpret_cast<sockaddr*>(&local), &size);
  local_port_ = ntohs(local.sin_port);
}

bool UdpLink::Send(std::span<const uint8_t> frame) {
  if (listen_ && !peer_known_) return false;
  const ssize_t sent = sendto(socket_, frame.data(), frame.size(), MSG_NOSIGNAL,
                              listen_ ? reinterpret_cast<const sockaddr*>(&peer_) : nullptr,
                              listen_ ? sizeof(peer_) : 0);
  return sent == static_cast<ssize_t>(frame.size());
}

size_t UdpLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  while (WaitReadable(deadline)) {
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    const ssize_t received =
        recvfrom(socket_, frame.data(), frame.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    // An error here is what an earlier datagram met (nobody listens yet), or an empty datagram.
    if (received <= 0) continue;
    peer_ = from;
    peer_known_ = true;
    return static_cast<size_t>(received);
  }
  return 0;
}

RawLink::RawLink(const std::string& interface, Side side) : side_(side) {
  const auto fail = [&](std::string_view problem) {
    throw EthercatError("EtherCAT on interface \"{}\": {}", interface, problem);
  };
  // Protocol 0 until bind(): a socket with one takes the frames of every interface meanwhile.
  socket_ = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) {
    fail(fmt::format("{}; run as root or with CAP_NET_RAW, or use EtherCAT over UDP",
                     std::strerror(errno)));
  }
  ifreq request{};
  if (interface.empty() || interface.size() >= sizeof(request.ifr_name)) {
    fail("no such interface; `ip link` lists them");
  }
  interface.copy(request.ifr_name, sizeof(request.ifr_name) - 1);
  if (ioctl(socket_, SIOCGIFINDEX, &request) != 0) fail("no such interface; `ip link` lists them");
  const int index = request.ifr_ifindex;
  if (ioctl(socket_, SIOCGIFFLAGS, &request) != 0 || (request.ifr_flags & IFF_UP) == 0) {
    fail(fmt::format("is down; `ip link set {} up`", interface));
  }
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(kEtherType);
  address.sll_ifindex = index;
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fail(std::strerror(errno));
  }
  if (ioctl(socket_, SIOCGIFHWADDR, &request) != 0) fail(std::strerror(errno));
  std::fill_n(out_.begin(), 6, uint8_t{0xFF});  // to all
  std::memcpy(&out_[6], request.ifr_hwaddr.sa_data, 6);
  out_[12] = kEtherType >> 8;
  out_[13] = kEtherType & 0xFF;
}

bool RawLink::Send(std::span<const uint8_t> frame) {
  if (frame.size() > kMaxFrame) return false;
  auto* const end = std::copy(frame.begin(), frame.end(), out_.begin() + kEthernetHeader);
  if (end < out_.begin() + kMinEthernet) std::fill(end, out_.begin() + kMinEthernet, uint8_t{0});
  const size_t size = std::max(kEthernetHeader + frame.size(), kMinEthernet);
  return send(socket_, out_.data(), size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}

size_t RawLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  while (WaitReadable(deadline)) {
    sockaddr_ll from{};
    socklen_t from_size = sizeof(from);
    const ssize_t received = recvfrom(socket_, in_.data(), in_.size(), 0,
                                      reinterpret_cast<sockaddr*>(&from), &from_size);
    if (received <= static_cast<ssize_t>(kEthernetHeader)) continue;
    if (from.sll_pkttype == PACKET_OUTGOING) continue;
    // Another master's frames may pass here, too. A frame of its own that comes in has been at the
    // slaves or been sent back on the way, which the working counter tells; an ESC changes a bit of
    // the source.
    const bool own = ((in_[6] ^ out_[6]) & ~kLocallyAdministered) == 0 &&
                     std::equal(in_.begin() + 7, in_.begin() + 12, out_.begin() + 7);
    if (side_ == Side::kMaster && !own) continue;
    if (side_ == Side::kSlaves) {
      std::copy_n(in_.begin(), 12, out_.begin());
      out_[6] |= kLocallyAdministered;
    }
    const size_t size = std::min(static_cast<size_t>(received) - kEthernetHeader, frame.size());
    std::copy_n(in_.begin() + kEthernetHeader, size, frame.begin());
    return size;
  }
  return 0;
}

void CheckLink(const LinkConfig& config) {
  CheckFields(config, "link.");
  if (config.has_udp() == config.has_interface()) {
    throw ConfigError("link", "must be either udp or interface");
  }
}

std::unique_ptr<SocketLink> OpenLink(const LinkConfig& config, SocketLink::Side side) {
  CheckLink(config);
  if (config.has_udp()) return std::make_unique<UdpLink>(config.udp(), side);
  return std::make_unique<RawLink>(config.interface(), side);
}

}  // namespace poise::ethercat
