// HTTP and WebSocket for this machine alone.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <string_view>

namespace poise {

/// "127.0.0.1:PORT" or "localhost:PORT": a page of another site that has its name resolve to this
/// machine sends its own.
bool IsHere(std::string_view host, int port);
/// "http://" before one of these.
bool IsOriginHere(std::string_view origin, int port);

class LocalServer;

/// A connection: one HTTP request, which may become a WebSocket. All that is received is bounded in
/// size and time. Removes itself from its server when it ends. No error of the other side throws.
class LocalClient : public std::enable_shared_from_this<LocalClient> {
 public:
  using Clock = std::chrono::steady_clock;

  virtual ~LocalClient() = default;
  void Start();
  /// Ends it at once.
  void Close();
  bool streaming() const { return streaming_; }
  /// Whether it has taken nothing for 5 s of what was written.
  bool stuck() const;
  Clock::time_point came() const { return came_; }

 protected:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  using Status = boost::beast::http::status;
  using Text = std::shared_ptr<const std::string>;

  /// `most_received`: bytes a WebSocket message. `server` must outlive it.
  LocalClient(boost::asio::ip::tcp::socket socket, LocalServer* server, size_t most_received);

  /// A request that this machine's own programs or pages have sent: Respond or Upgrade.
  virtual void Answer(const Request& request) = 0;
  /// Called when it has become a WebSocket.
  virtual void Opened() = 0;
  /// A message; false: none of ours sends it, and the connection ends.
  virtual bool Take(std::string_view message, bool text) = 0;
  /// Whether the next message is read already; Receive goes on.
  virtual bool Reads() const { return true; }
  /// Called when what was written is on its way.
  virtual void Written() = 0;

  /// Sends it and closes.
  void Respond(Status status, Text body, std::string_view type);
  void Refuse(Status status, std::string text);
  /// `protocol`: of WebSocket, agreed upon; empty: none.
  void Upgrade(std::string_view protocol = {});
  void Receive();
  /// One message, `head` and then `rest`, which may be null; not before the last one is Written.
  void Write(std::string head, Text rest, bool text);
  bool writing() const { return writing_; }
  bool closed() const { return closed_; }

 private:
  boost::beast::tcp_stream& Socket() { return stream_.next_layer(); }
  void Check();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  LocalServer* const server_;
  const size_t most_received_;
  boost::beast::flat_buffer buffer_;
  boost::beast::http::request_parser<boost::beast::http::empty_body> parser_;
  boost::beast::http::response<boost::beast::http::span_body<const char>> response_;
  boost::beast::http::response_serializer<boost::beast::http::span_body<const char>> serializer_{
      response_};
  Text body_;
  std::string head_;  // of what is being written, with its rest
  Text rest_;
  bool streaming_ = false, closed_ = false, reading_ = false, writing_ = false;
  Clock::time_point write_start_;
  const Clock::time_point came_ = Clock::now();
};

/// Listens on 127.0.0.1 and holds its connections, 2,000 new ones a second at most. When all places
/// are taken, the oldest that does not stream makes room: one that streams keeps its place whoever
/// else connects. Requests that name another host or come from another origin are refused. Runs on
/// the caller's thread.
class LocalServer {
 public:
  /// `port` 0: a free one. Throws ConfigError when it cannot be had, which begins with `flag` and
  /// ends with `advice`.
  LocalServer(int port, std::string_view flag, std::string_view advice, size_t most_clients);
  virtual ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  int port() const { return port_; }
  /// Sends, receives and accepts for this long.
  void RunFor(std::chrono::milliseconds duration) { io_.run_for(duration); }
  /// Sends, receives and accepts what it can without waiting.
  void Poll() { io_.poll(); }
  /// Why a page of this origin may not connect; empty: it may.
  virtual std::string WhyForeign(std::string_view origin) const = 0;

 protected:
  virtual std::shared_ptr<LocalClient> MakeClient(boost::asio::ip::tcp::socket socket) = 0;
  /// Whoever goes through them copies the set where one may end meanwhile.
  const std::set<std::shared_ptr<LocalClient>>& clients() const { return clients_; }

 private:
  friend class LocalClient;
  void Accept();
  void AcceptAfter(std::chrono::milliseconds duration);
  void Admit(boost::asio::ip::tcp::socket socket);

  boost::asio::io_context io_{1};
  boost::asio::ip::tcp::acceptor acceptor_{io_};
  boost::asio::steady_timer accept_timer_{io_};
  int port_ = 0;
  const size_t most_clients_;
  LocalClient::Clock::time_point window_{};
  int accepted_ = 0;  // since window_
  std::set<std::shared_ptr<LocalClient>> clients_;
};

}  // namespace poise
