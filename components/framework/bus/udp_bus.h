// LCM over UDP multicast, one object a URL.
#pragma once

#include <poll.h>

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/file_descriptor.h"

typedef struct _lcm_t lcm_t;

namespace poise {

/// The bus cannot be used. what() is one line with the reason and what to do.
class BusError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "udpm://GROUP:PORT?ttl=TTL".
struct BusEndpoint {
  uint32_t group = 0;  ///< network byte order
  uint16_t port = 0;   ///< host byte order
};
/// Throws BusError.
BusEndpoint ParseBusUrl(const std::string& url);
/// Throws BusError when the machine has no route to a URL of the bus; sends nothing.
void CheckBusRoute(const std::string& url);
/// First four bytes of a message in one datagram: "LC02"; then a sequence number, channel, zero,
/// data.
inline constexpr uint32_t kShortMagic = 0x4c433032;

/// Sends on one "udpm://GROUP:PORT?ttl=TTL" through liblcm, as any other program does: no run takes
/// it for its own (RunSender). Never falls back to another transport.
class BusSender {
 public:
  /// Throws BusError, e.g. when the machine has no multicast route.
  explicit BusSender(const std::string& url);
  /// False when the system refused to send. Does not allocate below 64 KB.
  bool Send(const char* channel, const uint8_t* data, size_t size);

 private:
  struct Destroy {
    void operator()(lcm_t* lcm) const;
  };
  std::unique_ptr<lcm_t, Destroy> lcm_;
};

/// Whose packets a receiver takes; the kernel drops the others before they wake anyone.
struct Origin {
  enum Who {
    kAnyone,
    kRun,     ///< sent by this machine from `port`: see RunSocket
    kOthers,  ///< all but these
  };
  Who who = kAnyone;
  uint16_t port = 0;
};

/// Where a datagram came from.
struct PacketSource {
  uint32_t address = 0;  ///< network byte order
  uint16_t port = 0;     ///< host byte order
  bool operator==(const PacketSource&) const = default;
};
/// "127.0.0.1:40123".
std::string ToString(const PacketSource& source);

/// Receives LCM messages of one URL on the caller's thread: poll fd(), then call Receive. It reads
/// the wire itself since liblcm 1.3.1 crashes on a fragment with a hostile offset, and its
/// receiving thread costs each hop a wake-up. Messages in several fragments are refused: those of
/// the bus fit into one datagram.
class BusReceiver {
 public:
  /// Throws BusError.
  explicit BusReceiver(const std::string& url, Origin origin = {});

  int fd() const { return fd_; }

  struct Packet {
    std::string_view channel;
    const uint8_t* data = nullptr;
    size_t size = 0;
  };
  /// The next LCM message that has arrived, if any; does not block. Valid until the next call.
  bool Receive(Packet* packet);
  /// Takes the next datagram, LCM message or not, with its source. False when none waits.
  bool ReceiveAny(std::span<const uint8_t>* datagram, PacketSource* source);
  /// Datagrams that were no LCM message.
  int64_t malformed() const { return malformed_; }

 private:
  FileDescriptor fd_;
  int64_t malformed_ = 0;
  std::vector<uint8_t> buffer_;
};

/// One datagram of LCM's wire format: the message it holds, or false. Reads nothing outside the
/// datagram.
bool ParseDatagram(const uint8_t* datagram, size_t size, BusReceiver::Packet* packet);

}  // namespace poise
