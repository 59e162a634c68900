#include "components/framework/bus/run_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <utility>

#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr timeval kAskPatience{3, 0};

/// Where a run's socket is asked for: an abstract name, which ends with its owner.
struct DeskName {
  explicit DeskName(const RunSpec& spec) {
    address.sun_family = AF_UNIX;
    const std::string name = fmt::format("poise-run-{}", SourcePort(spec));
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&address); }
  sockaddr_un address{};
  socklen_t size;
};

[[noreturn]] void Throw(const RunSpec& spec, std::string_view what) {
  throw BusError(fmt::format("port {}: {}: {}", SourcePort(spec), what, std::strerror(errno)));
}

FileDescriptor OpenSource(const RunSpec& spec) {
  CheckBusRoute(ServiceUrl(spec));
  FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (fd < 0) Throw(spec, "socket");
  const auto ttl = static_cast<unsigned char>(spec.ttl());
  if (setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl)) != 0)
    Throw(spec, "IP_MULTICAST_TTL");
  // On all addresses, and not to be shared: who could have the port on another address could still
  // name ours as a packet's source.
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(SourcePort(spec)));
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    Throw(spec, "the run's source port cannot be had");
  return fd;
}

/// -1: the machine has no IPv6.
FileDescriptor OpenGuard(const RunSpec& spec) {
  FileDescriptor fd(socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (fd < 0) return -1;
  const int one = 1;
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_port = htons(static_cast<uint16_t>(SourcePort(spec)));
  if (setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &one, sizeof(one)) != 0 ||
      bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    Throw(spec, "the run's source port of IPv6 cannot be had");
  return fd;
}

FileDescriptor OpenDesk(const RunSpec& spec) {
  FileDescriptor fd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const DeskName name(spec);
  constexpr int kBacklog = 32;
  if (fd < 0 || bind(fd, name.get(), name.size) != 0 || listen(fd, kBacklog) != 0)
    Throw(spec, "the place where it is asked for cannot be had");
  return fd;
}

/// A message of one byte that carries `fd`, or room for one.
class Parcel {
 public:
  Parcel() {
    header_.msg_iov = &part_;
    header_.msg_iovlen = 1;
    header_.msg_control = control_.data();
    header_.msg_controllen = control_.size();
  }
  bool Send(int to, int fd) {
    cmsghdr* const passed = CMSG_FIRSTHDR(&header_);
    passed->cmsg_level = SOL_SOCKET;
    passed->cmsg_type = SCM_RIGHTS;
    passed->cmsg_len = CMSG_LEN(sizeof(fd));
    std::memcpy(CMSG_DATA(passed), &fd, sizeof(fd));
    return sendmsg(to, &header_, MSG_NOSIGNAL | MSG_DONTWAIT) == 1;
  }
  /// -1: none came.
  int Receive(int from) {
    int fd = -1;
    if (recvmsg(from, &header_, MSG_CMSG_CLOEXEC) != 1) return fd;
    const cmsghdr* const passed = CMSG_FIRSTHDR(&header_);
    if (passed != nullptr && passed->cmsg_type == SCM_RIGHTS)
      std::memcpy(&fd, CMSG_DATA(passed), sizeof(fd));
    return fd;
  }

 private:
  char byte_ = 0;
  iovec part_{&byte_, 1};
  msghdr header_{};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control_{};
};

/// Gives `socket` to those of this user and of root who connect, until `desk` is shut down.
void Answer(int desk, int socket) {
  while (true) {
    const FileDescriptor asker(accept4(desk, nullptr, nullptr, SOCK_CLOEXEC));
    if (asker < 0 && errno != ECONNABORTED) return;
    ucred user{};
    socklen_t size = sizeof(user);
    if (getsockopt(asker, SOL_SOCKET, SO_PEERCRED, &user, &size) != 0) continue;
    // A refused one sees the end of the connection.
    if (user.uid == geteuid() || user.uid == 0) Parcel().Send(asker, socket);
  }
}

}  // namespace

int SourcePort(const RunSpec& spec) {
  constexpr int kServiceAndMirror = 2;
  return spec.first_port() + kServiceAndMirror + spec.graph().channel_size();
}

Origin OfRun(const RunSpec& spec) {
  return {Origin::kRun, static_cast<uint16_t>(SourcePort(spec))};
}

Origin OfOthers(const RunSpec& spec) {
  return {Origin::kOthers, static_cast<uint16_t>(SourcePort(spec))};
}

RunSocket::RunSocket(const RunSpec& spec, FileDescriptor fd) : fd_(std::move(fd)) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  if (getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
      address.sin_family == AF_INET && ntohs(address.sin_port) == SourcePort(spec)) {
    return;
  }
  throw BusError(fmt::format("descriptor {} is not the socket of this run, which has port {}",
                             this->fd(), SourcePort(spec)));
}

RunSocket RunSocket::Ask(const RunSpec& spec) {
  const FileDescriptor desk(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const DeskName name(spec);
  setsockopt(desk, SOL_SOCKET, SO_SNDTIMEO, &kAskPatience, sizeof(kAskPatience));
  setsockopt(desk, SOL_SOCKET, SO_RCVTIMEO, &kAskPatience, sizeof(kAskPatience));
  if (desk < 0 || connect(desk, name.get(), name.size) != 0) {
    throw BusError(
        fmt::format("run {}: nobody gives out its socket (port {}): {}; has it ended? start one "
                    "with poise run",
                    spec.run_id(), SourcePort(spec), std::strerror(errno)));
  }
  errno = 0;
  const int fd = Parcel().Receive(desk);
  if (fd >= 0) return {spec, fd};
  if (errno == EAGAIN) {
    throw BusError(fmt::format(
        "run {}: its launcher has not answered for 3 s; does the run's reference still go on?",
        spec.run_id()));
  }
  ucred owner{};
  socklen_t size = sizeof(owner);
  getsockopt(desk, SOL_SOCKET, SO_PEERCRED, &owner, &size);
  throw BusError(
      fmt::format("run {}: it is of user {} and takes messages from that user and root alone; "
                  "poise estop stops it all the same",
                  spec.run_id(), owner.uid));
}

RunSource::RunSource(const RunSpec& spec)
    : socket_(spec, OpenSource(spec)), guard_(OpenGuard(spec)), desk_(OpenDesk(spec)) {
  // Signals are for the program's other threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    thread_ = std::thread(Answer, int{desk_}, socket_.fd());
  } catch (...) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    throw;
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

RunSource::~RunSource() {
  if (desk_ < 0) return;  // moved from
  shutdown(desk_, SHUT_RDWR);
  thread_.join();
}

RunSender::RunSender(const RunSocket& socket, const std::string& url) : fd_(socket.fd()) {
  const BusEndpoint endpoint = ParseBusUrl(url);
  CheckBusRoute(url);
  group_ = endpoint.group;
  port_ = htons(endpoint.port);
}

bool RunSender::Send(std::string_view channel, const uint8_t* data, size_t size) {
  const std::array<uint32_t, 2> header = {htonl(kShortMagic), htonl(sequence_++)};
  char end = 0;
  const auto part = [](const void* bytes, size_t count) {
    return iovec{const_cast<void*>(bytes), count};
  };
  std::array<iovec, 4> parts = {part(header.data(), sizeof(header)),
                                part(channel.data(), channel.size()), part(&end, 1),
                                part(data, size)};
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = port_;
  address.sin_addr.s_addr = group_;
  msghdr message{};
  message.msg_name = &address;
  message.msg_namelen = sizeof(address);
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  return sendmsg(fd_, &message, 0) >= 0;
}

}  // namespace poise
