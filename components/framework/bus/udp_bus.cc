#include "components/framework/bus/udp_bus.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr char kAdvice[] =
    "is multicast routed? try: ip link set lo up; ip route add 224.0.0.0/4 dev lo; or run: poise "
    "doctor";
constexpr uint32_t kShortMagic = 0x4c433032;  // "LC02": magic, sequence number, channel, zero, data
constexpr size_t kShortHeader = 8;
constexpr size_t kMaxChannelName = 63;
constexpr size_t kMaxDatagram = 65536;
constexpr int kMaxMalformedInARow = 16;

struct Endpoint {
  in_addr group{};
  uint16_t port = 0;
};

/// "udpm://GROUP:PORT?ttl=N".
Endpoint ParseUrl(const std::string& url) {
  Endpoint endpoint;
  const std::string_view prefix = "udpm://";
  const size_t colon = url.find(':', prefix.size());
  int port = 0;
  if (url.starts_with(prefix) && colon != std::string::npos) {
    const std::string group = url.substr(prefix.size(), colon - prefix.size());
    std::from_chars(url.data() + colon + 1, url.data() + url.size(), port);
    if (inet_pton(AF_INET, group.c_str(), &endpoint.group) == 1 &&
        IN_MULTICAST(ntohl(endpoint.group.s_addr)) && port > 0 && port < 65536) {
      endpoint.port = static_cast<uint16_t>(port);
      return endpoint;
    }
  }
  throw BusError(fmt::format(
      "{}: is no bus; write udpm://GROUP:PORT?ttl=TTL with a multicast group (239.x.x.x) and a "
      "port of 1 to 65535",
      url));
}

/// Asks the kernel, without sending: liblcm would print lines of its own.
void CheckRoute(const std::string& url, const Endpoint& endpoint) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  address.sin_addr = endpoint.group;
  const bool routed =
      fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  const int reason = errno;
  if (fd >= 0) close(fd);
  if (!routed)
    throw BusError(fmt::format("{}: cannot send: {}: {}", url, std::strerror(reason), kAdvice));
}

}  // namespace

void BusSender::Destroy::operator()(lcm_t* lcm) const { lcm_destroy(lcm); }

BusSender::BusSender(const std::string& url) {
  CheckRoute(url, ParseUrl(url));
  lcm_.reset(lcm_create(url.c_str()));
  if (lcm_ == nullptr) throw BusError(fmt::format("{}: cannot send: {}", url, kAdvice));
}

bool BusSender::Send(const char* channel, const uint8_t* data, size_t size) {
  return lcm_publish(lcm_.get(), channel, data, static_cast<unsigned int>(size)) == 0;
}

BusReceiver::BusReceiver(const std::string& url) : buffer_(kMaxDatagram) {
  const Endpoint endpoint = ParseUrl(url);
  const auto fail = [&](const char* what) {
    const int reason = errno;
    if (fd_ >= 0) close(fd_);
    throw BusError(
        fmt::format("{}: cannot receive: {}: {}: {}", url, what, std::strerror(reason), kAdvice));
  };
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) fail("socket");
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
  address.sin_addr =
      endpoint.group;  // not INADDR_ANY: other groups and unicast on this port stay out
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) fail("bind");
  ip_mreq membership{};
  membership.imr_multiaddr = endpoint.group;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof(membership)) != 0)
    fail("joining the group");
}

BusReceiver::~BusReceiver() { close(fd_); }

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
