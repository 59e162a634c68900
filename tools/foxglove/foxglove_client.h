// One connection of a Foxglove server.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace poise {

/// What a client asks of its server.
class FoxgloveHost {
 public:
  virtual ~FoxgloveHost() = default;
  virtual int port() const = 0;
  virtual bool IsOriginAllowed(std::string_view origin) const = 0;
  virtual size_t num_channels() const = 0;
  /// "serverInfo" and "advertise" of the protocol.
  virtual const std::string& server_info() const = 0;
  virtual std::shared_ptr<const std::string> advertisement() const = 0;
  struct Kept {
    uint64_t time = 0;  ///< ns
    std::shared_ptr<const std::string> message;
  };
  /// Whether a channel has a share of what may wait, which others leave to it.
  virtual bool HasPrecedence(size_t channel) const = 0;
  /// The message of a channel that later subscribers get as well; null without one.
  virtual const Kept* KeptOf(size_t channel) const = 0;
};

/// A connection: one HTTP request, which must become the protocol's WebSocket. All that is received
/// is bounded in size and time. What waits to be sent is bounded too: beyond it messages are
/// dropped, counted, and the client is told; channels without precedence fill half of it at most.
/// Who takes nothing for 5 s is dropped itself. Reading pauses while answers wait. No error throws.
class FoxgloveClient : public std::enable_shared_from_this<FoxgloveClient> {
 public:
  /// `host` must outlive it.
  FoxgloveClient(boost::asio::ip::tcp::socket socket, FoxgloveHost* host);

  void Start();
  /// A message of a channel, if the client has subscribed to it.
  void Send(size_t channel, uint64_t time, const std::shared_ptr<const std::string>& message);
  /// The time op: ns.
  void SendTime(uint64_t time);
  /// Tells what was dropped, and ends a connection that takes nothing.
  void Check();
  void Close();

  bool closed() const { return closed_; }
  bool wants(size_t channel) const { return subscriptions_of_.contains(channel); }
  int64_t dropped() const { return dropped_; }

 private:
  struct Outgoing {
    std::string head;  // of the frame: all of a text
    std::shared_ptr<const std::string> message;
    bool binary = false;
    size_t size() const { return head.size() + (message ? message->size() : 0); }
  };

  boost::beast::tcp_stream& Socket() { return stream_.next_layer(); }
  void Answer();
  void Respond(boost::beast::http::status status, std::string text);
  void Upgrade();
  void Receive();
  void Handle();
  void HandleSubscribe(size_t subscription, size_t channel);
  void Tell(int level, std::string_view text);
  void Queue(Outgoing outgoing);
  void QueueMessage(uint32_t subscription, uint64_t time,
                    const std::shared_ptr<const std::string>& message);
  void Write();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  FoxgloveHost* host_;
  boost::beast::flat_buffer buffer_;
  boost::beast::http::request_parser<boost::beast::http::empty_body> parser_;
  boost::beast::http::response<boost::beast::http::string_body> response_;
  bool streaming_ = false;
  bool closed_ = false;
  bool writing_ = false;
  bool reading_ = false;
  std::chrono::steady_clock::time_point write_start_;
  std::deque<Outgoing> queue_;
  size_t queued_bytes_ = 0;
  int64_t dropped_ = 0;
  int64_t dropped_told_ = 0;
  std::chrono::steady_clock::time_point told_;
  std::map<uint32_t, size_t> channel_of_;        // by subscription
  std::map<size_t, uint32_t> subscriptions_of_;  // by channel, which has one at most
};

}  // namespace poise
