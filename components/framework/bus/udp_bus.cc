#include "components/framework/bus/udp_bus.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr char kAdvice[] =
    "is multicast routed? try: ip link set lo up; ip route add 224.0.0.0/4 dev lo; or run: poise "
    "doctor";
constexpr size_t kShortHeader = 8;
constexpr size_t kMaxChannelName = 63;
constexpr size_t kMaxDatagram = 65536;
constexpr int kMaxMalformedInARow = 16;

/// Lets the kernel drop all that is not of `origin`: what this machine has sent from the port, or
/// all but that.
bool Filter(int fd, Origin origin) {
  if (origin.who == Origin::kAnyone) return true;
  const uint32_t taken = origin.who == Origin::kRun ? UINT32_MAX : 0;
  const uint32_t others = ~taken;
  // Multicast of this machine comes back as PACKET_LOOPBACK or, where it is routed so, through lo.
  constexpr auto kAncillary = static_cast<uint32_t>(SKF_AD_OFF);
  std::array<sock_filter, 8> code = {{
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, 0),  // UDP source port
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, origin.port, 0, 5),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kAncillary + SKF_AD_PKTTYPE),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 2, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kAncillary + SKF_AD_IFINDEX),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex("lo"), 0, 1),
      BPF_STMT(BPF_RET | BPF_K, taken),
      BPF_STMT(BPF_RET | BPF_K, others),
  }};
  const sock_fprog program{static_cast<uint16_t>(code.size()), code.data()};
  return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) == 0;
}

}  // namespace

BusEndpoint ParseBusUrl(const std::string& url) {
  in_addr address{};
  const std::string_view prefix = "udpm://";
  const size_t colon = url.find(':', prefix.size());
  int port = 0;
  if (url.starts_with(prefix) && colon != std::string::npos) {
    const std::string group = url.substr(prefix.size(), colon - prefix.size());
    std::from_chars(url.data() + colon + 1, url.data() + url.size(), port);
    if (inet_pton(AF_INET, group.c_str(), &address) == 1 && IN_MULTICAST(ntohl(address.s_addr)) &&
        port > 0 && port < 65536) {
      return {address.s_addr, static_cast<uint16_t>(port)};
    }
  }
  throw BusError(fmt::format(
      "{}: is no bus; write udpm://GROUP:PORT?ttl=TTL with a multicast group (239.x.x.x) and a "
      "port of 1 to 65535",
      url));
}

// Asks the kernel: liblcm would send, and print lines of its own.
void CheckBusRoute(const std::string& url) {
  const BusEndpoint endpoint = ParseBusUrl(url);
  const FileDescriptor fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  address.sin_addr.s_addr = endpoint.group;
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    throw BusError(fmt::format("{}: cannot send: {}: {}", url, std::strerror(errno), kAdvice));
}

std::string ToString(const PacketSource& source) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &source.address, text.data(), text.size());
  return fmt::format("{}:{}", text.data(), source.port);
}

void BusSender::Destroy::operator()(lcm_t* lcm) const { lcm_destroy(lcm); }

BusSender::BusSender(const std::string& url) {
  CheckBusRoute(url);
  lcm_.reset(lcm_create(url.c_str()));
  if (lcm_ == nullptr) throw BusError(fmt::format("{}: cannot send: {}", url, kAdvice));
}

bool BusSender::Send(const char* channel, const uint8_t* data, size_t size) {
  return lcm_publish(lcm_.get(), channel, data, static_cast<unsigned int>(size)) == 0;
}

BusReceiver::BusReceiver(const std::string& url, Origin origin) : buffer_(kMaxDatagram) {
  const BusEndpoint endpoint = ParseBusUrl(url);
  const auto fail = [&](const char* what) {
    throw BusError(
        fmt::format("{}: cannot receive: {}: {}: {}", url, what, std::strerror(errno), kAdvice));
  };
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) fail("socket");
  if (!Filter(fd_, origin)) fail("SO_ATTACH_FILTER");
  const int one = 1;
  const int zero = 0;
  const int receive_buffer = 4 << 20;  // the kernel grants what it may
  if (setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &one, sizeof(one)) != 0) fail("SO_REUSEADDR");
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer)) != 0)
    fail("SO_RCVBUF");
  if (setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_ALL, &zero, sizeof(zero)) != 0)
    fail("IP_MULTICAST_ALL");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  address.sin_addr.s_addr =
      endpoint.group;  // not INADDR_ANY: other groups and unicast on this port stay out
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) fail("bind");
  ip_mreq membership{};
  membership.imr_multiaddr.s_addr = endpoint.group;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof(membership)) != 0)
    fail("joining the group");
}

bool BusReceiver::Receive(Packet* packet) {
  // Bounded: a flood of noise must not keep the caller here.
  for (int i = 0; i < kMaxMalformedInARow; ++i) {
    const ssize_t size = recv(fd_, buffer_.data(), buffer_.size(), 0);
    if (size < 0) return false;  // nothing there; an error of the network shows at the next packet
    if (ParseDatagram(buffer_.data(), static_cast<size_t>(size), packet)) return true;
    ++malformed_;
  }
  return false;
}

bool BusReceiver::ReceiveAny(std::span<const uint8_t>* datagram, PacketSource* source) {
  sockaddr_in from{};
  socklen_t length = sizeof(from);
  const ssize_t size =
      recvfrom(fd_, buffer_.data(), buffer_.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  if (size < 0) return false;
  *datagram = {buffer_.data(), static_cast<size_t>(size)};
  *source = {from.sin_addr.s_addr, ntohs(from.sin_port)};
  return true;
}

bool ParseDatagram(const uint8_t* datagram, size_t size, BusReceiver::Packet* packet) {
  if (size <= kShortHeader || static_cast<uint32_t>(ReadInt32(datagram)) != kShortMagic)
    return false;
  const uint8_t* name = datagram + kShortHeader;
  const size_t rest = size - kShortHeader;
  const auto* end =
      static_cast<const uint8_t*>(std::memchr(name, 0, std::min(rest, kMaxChannelName + 1)));
  if (end == nullptr) return false;
  packet->channel = {reinterpret_cast<const char*>(name), static_cast<size_t>(end - name)};
  packet->data = end + 1;
  packet->size = static_cast<size_t>(datagram + size - packet->data);
  return true;
}

}  // namespace poise
