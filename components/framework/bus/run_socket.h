// The one socket that all processes of a run send from, and who is given it.
//
// A run's receivers take packets of this machine from the run's source port alone; the kernel drops
// the rest (BusReceiver). The kernel gives that port to nobody else while the socket is open, and
// so a packet's source tells that its sender has been handed the socket.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/file_descriptor.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// UDP port that a run's packets come from: the first after those of its channels.
int SourcePort(const RunSpec& spec);
/// What a receiver takes: what the run has sent, or all else.
Origin OfRun(const RunSpec& spec);
Origin OfOthers(const RunSpec& spec);

/// A descriptor of the run's socket.
class RunSocket {
 public:
  /// One that a parent process has handed on; it is closed with this. Throws BusError when it is
  /// not this run's.
  RunSocket(const RunSpec& spec, FileDescriptor fd);
  /// Asks whoever started the run, who gives it to the same user and to root. Waits up to 3 s.
  /// Throws BusError.
  static RunSocket Ask(const RunSpec& spec);

  int fd() const { return fd_; }

 private:
  FileDescriptor fd_;
};

/// Opens the socket of a run and hands it out, on a thread of its own, to those who ask. Who starts
/// a run keeps this until the run has ended.
class RunSource {
 public:
  /// Throws BusError: no multicast route, or somebody has the port; std::system_error.
  explicit RunSource(const RunSpec& spec);
  RunSource(RunSource&&) = default;
  RunSource& operator=(RunSource&&) = delete;
  ~RunSource();

  const RunSocket& socket() const { return socket_; }

 private:
  RunSocket socket_;
  FileDescriptor guard_;  // the port of IPv6: packets of IPv4 can be sent from there too
  FileDescriptor desk_;   // where the socket is asked for
  std::thread thread_;
};

/// Sends a run's messages on one URL. Does not allocate after construction.
class RunSender {
 public:
  /// `socket` must outlive this. Throws BusError, e.g. when the machine has no multicast route.
  RunSender(const RunSocket& socket, const std::string& url);
  /// False when the system refused to send. Takes what fits into one datagram, 65,499 bytes with
  /// the channel's name.
  bool Send(std::string_view channel, const uint8_t* data, size_t size);

 private:
  int fd_;
  uint32_t group_;  // network byte order, as port_
  uint16_t port_;
  uint32_t sequence_ = 0;
};

}  // namespace poise
