#include "tools/live/view_server.h"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <set>
#include <string_view>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/live/view_access.h"
#include "tools/run/loopback.h"

namespace poise {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using ErrorCode = boost::system::error_code;

constexpr size_t kMaxConnections = 32;
constexpr size_t kMaxStreams = 16;         // the other places are for those who come
constexpr uint32_t kMaxHeader = 16 << 10;  // bytes; browsers send about 1 KB
constexpr size_t kMaxReceived = 1 << 10;   // bytes a WebSocket message; acts have about 200
constexpr double kActRate = 60;            // texts/s of a client; a dragged robot's are 30
constexpr double kActBurst = 60;           // texts at once
constexpr int kMaxAccepts = 200;           // in each kAcceptWindow: 2,000/s
constexpr std::chrono::milliseconds kAcceptWindow{100};
constexpr size_t kMaxBatch = size_t{1} << 20;  // bytes
constexpr int64_t kMostBehind = 4;      // batches: then what a client lacks waits until it asks
constexpr int kSendBuffer = 256 << 10;  // bytes, in the system
constexpr std::chrono::seconds kRequestPatience{5};
constexpr std::chrono::seconds kSendPatience{5};
constexpr std::chrono::milliseconds kAcceptPause{100};  // when the system has no more sockets

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }
beast::string_view BeastView(std::string_view text) { return {text.data(), text.size()}; }

/// s, of a clock that goes on evenly.
double Seconds() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

}  // namespace

class ViewServer::Impl {
 public:
  Impl(int port, std::string page, const TickRing* ring, ViewControl control);
  ~Impl();

  int port() const { return port_; }
  std::string url() const;
  int64_t dropped() const { return dropped_; }
  void RunFor(std::chrono::milliseconds duration) { io_.run_for(duration); }
  void SendTicks();
  void SetState(std::string json);
  void SetStatus(std::string json);
  void SetControl(std::string json);
  void Restart();

 private:
  class Client;

  void Accept();
  void Wait(std::chrono::milliseconds duration);
  void Admit(tcp::socket socket);
  size_t streams() const;
  std::shared_ptr<const std::string> Batch(int64_t from, int64_t to);

  asio::io_context io_{1};
  tcp::acceptor acceptor_{io_};
  asio::steady_timer accept_timer_{io_};
  int port_ = 0;
  const std::string page_;
  const TickRing* ring_;
  const ViewControl control_;
  Clock::time_point window_{};
  int accepted_ = 0;  // since window_
  std::shared_ptr<const std::string> state_ = std::make_shared<std::string>();
  std::shared_ptr<const std::string> status_;
  std::shared_ptr<const std::string> acts_;
  // The batch made last: clients that keep up want the same.
  std::shared_ptr<const std::string> batch_;
  int64_t batch_from_ = -1;
  int64_t batch_to_ = -1;
  int64_t dropped_ = 0;
  std::set<std::shared_ptr<Client>> clients_;
};

/// A connection: one HTTP request, which may become the stream. Removes itself when it ends.
class ViewServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(tcp::socket socket, Impl* server) : stream_(std::move(socket)), server_(server) {}

  void Start() {
    ErrorCode ignored;  // the default sizes do as well
    Socket().socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    parser_.header_limit(kMaxHeader);
    Socket().expires_after(kRequestPatience);
    http::async_read(Socket(), buffer_, parser_,
                     [self = shared_from_this()](ErrorCode error, size_t) {
                       if (error) {
                         self->Refuse(error);
                       } else {
                         self->Answer();
                       }
                     });
  }

  void SendTicks() {
    if (!streaming_) return;
    if (sending_ && Clock::now() > send_start_ + kSendPatience) {
      ++server_->dropped_;
      Close();
    } else {
      Send();
    }
  }

  bool streaming() const { return streaming_; }
  Clock::time_point came() const { return came_; }
  void Restart() { next_ = 0; }

  /// Ends it at once.
  void Close() {
    ErrorCode ignored;
    Socket().socket().close(ignored);
    streaming_ = false;
    server_->clients_.erase(shared_from_this());
  }

 private:
  beast::tcp_stream& Socket() { return stream_.next_layer(); }

  void Refuse(ErrorCode error) {
    if (error.category() == http::make_error_code(http::error::end_of_stream).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message) {
      Respond(http::status::bad_request, "no request that is understood here\n");
    } else {
      Close();
    }
  }

  void Answer() {
    const auto& request = parser_.get();
    const auto origin = request.find(http::field::origin);
    const bool foreign =
        origin != request.end() && !IsOriginHere(View(origin->value()), server_->port_);
    const std::optional<ViewTarget> target = ReadTarget(View(request.target()));
    const std::string& token = server_->control_.token;
    if (!IsUnambiguous(request)) {
      Respond(http::status::bad_request, "one Host and one Origin at most\n");
    } else if (!IsHere(View(request[http::field::host]), server_->port_) || foreign) {
      Respond(http::status::forbidden,
              fmt::format("only for http://127.0.0.1:{}/\n", server_->port_));
    } else if (!token.empty() && (!target || !SameToken(target->token, token))) {
      Respond(http::status::forbidden, "the address that poise printed has a token\n");
    } else if (websocket::is_upgrade(request)) {
      if (!target || target->path != "/stream") {
        Respond(http::status::not_found, "the stream is /stream or /stream?from=TICK\n");
      } else if (!IsWebSocketKey(View(request[http::field::sec_websocket_key]))) {
        Respond(http::status::bad_request, "Sec-WebSocket-Key is not 16 bytes in base64\n");
      } else if (server_->streams() >= kMaxStreams) {
        Respond(http::status::service_unavailable, "too many pages are open\n");
      } else {
        Upgrade(target->from);
      }
    } else if (request.method() != http::verb::get && request.method() != http::verb::head) {
      Respond(http::status::method_not_allowed, "only GET\n");
    } else if (target && target->path == "/") {
      Respond(http::status::ok, server_->page_, "text/html; charset=utf-8");
    } else if (target && target->path == "/ticks") {
      Respond(http::status::ok, Earlier(target->before), "application/octet-stream");
    } else {
      Respond(http::status::not_found, "there is / and /ticks?before=TICK\n");
    }
  }

  /// The last batch of the ticks before `tick` that are still held; of no tick where there is none.
  std::string Earlier(int64_t tick) const {
    const TickRing& ring = *server_->ring_;
    const int64_t to = std::clamp(tick, ring.first_tick(), ring.end_tick());
    return ring.Encode(std::max(ring.first_tick(), to - BatchTicks()), to, Seconds());
  }

  /// Sends it and closes. The page is not copied: `body` of other texts is.
  void Respond(http::status status, std::string_view body,
               std::string_view type = "text/plain; charset=utf-8") {
    if (body.data() != server_->page_.data()) {
      text_ = body;
      body = text_;
    }
    response_.result(status);
    response_.version(11);
    response_.keep_alive(false);
    response_.set(http::field::content_type, BeastView(type));
    response_.set(http::field::cache_control, "no-store");
    response_.set(http::field::x_frame_options, "DENY");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    response_.set("Referrer-Policy", "no-referrer");  // the address may hold a token
    if (status == http::status::method_not_allowed) response_.set(http::field::allow, "GET, HEAD");
    response_.body() = beast::span<const char>(body.data(), body.size());
    response_.content_length(body.size());
    Socket().expires_after(kRequestPatience);
    const auto done = [self = shared_from_this()](ErrorCode, size_t) {
      ErrorCode ignored;
      self->Socket().socket().shutdown(tcp::socket::shutdown_send, ignored);
      self->Close();
    };
    if (parser_.get().method() == http::verb::head) {
      http::async_write_header(Socket(), serializer_, done);
    } else {
      http::async_write(Socket(), serializer_, done);
    }
  }

  void Upgrade(int64_t from) {
    next_ = from;
    Socket().expires_never();  // the stream has times of its own
    websocket::stream_base::timeout times{};
    times.handshake_timeout = kRequestPatience;
    times.idle_timeout = 4 * kRequestPatience;  // pings in between: half-open ones end
    times.keep_alive_pings = true;
    stream_.set_option(times);
    stream_.read_message_max(kMaxReceived);
    stream_.write_buffer_bytes(64 << 10);
    stream_.auto_fragment(false);
    stream_.async_accept(parser_.get(), [self = shared_from_this()](ErrorCode error) {
      if (error) {
        self->Close();
        return;
      }
      self->streaming_ = true;
      self->buffer_.clear();
      self->Receive();
      self->Send();
    });
  }

  /// Acts, pings and the end. A page that only looks sends no message.
  void Receive() {
    stream_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, size_t) {
      if (error || !self->Take()) {
        self->Close();
        return;
      }
      self->buffer_.clear();
      self->Receive();
    });
  }

  /// False: no page of ours sends this, or this much.
  bool Take() {
    const ViewControl& control = server_->control_;
    if (control.token.empty() || !streaming_ || !stream_.got_text()) return false;
    const auto now = Clock::now();
    const double passed = std::chrono::duration<double>(now - refilled_).count();
    allowance_ = std::min(kActBurst, allowance_ + kActRate * passed);
    refilled_ = now;
    if (allowance_ < 1) return false;
    --allowance_;
    const auto bytes = buffer_.cdata();
    return control.receive({static_cast<const char*>(bytes.data()), bytes.size()});
  }

  void Send() {
    if (sending_ || !streaming_) return;
    const TickRing& ring = *server_->ring_;
    if (sent_state_ != server_->state_) {
      sent_state_ = outgoing_ = server_->state_;
      stream_.text(true);
    } else if (sent_status_ != server_->status_) {
      sent_status_ = outgoing_ = server_->status_;
      stream_.text(true);
    } else if (sent_acts_ != server_->acts_) {
      sent_acts_ = outgoing_ = server_->acts_;
      stream_.text(true);
    } else if (next_ < ring.end_tick()) {
      next_ = std::max(next_, ring.first_tick());
      // What is new goes first.
      if (ring.end_tick() - next_ > kMostBehind * BatchTicks()) {
        next_ = ring.end_tick() - BatchTicks();
      }
      const int64_t to = std::min(ring.end_tick(), next_ + BatchTicks());
      outgoing_ = server_->Batch(next_, to);
      next_ = to;
      stream_.binary(true);
    } else {
      return;
    }
    sends_text_ = stream_.text();
    sending_ = true;
    send_start_ = Clock::now();
    stream_.async_write(asio::buffer(*outgoing_),
                        [self = shared_from_this()](ErrorCode error, size_t) {
                          self->sending_ = false;
                          if (error) {
                            self->Close();
                          } else if (self->Behind()) {
                            self->Send();
                          }
                        });
  }

  /// By a whole batch, or by what a text has kept waiting: then it does not wait for the next
  /// picture, which may begin with a text again.
  bool Behind() const {
    const int64_t ticks = server_->ring_->end_tick() - next_;  // negative: asked for later ones
    return sent_state_ != server_->state_ || sent_status_ != server_->status_ ||
           sent_acts_ != server_->acts_ || ticks >= (sends_text_ ? 1 : BatchTicks());
  }
  int64_t BatchTicks() const {
    return static_cast<int64_t>(std::max<size_t>(1, kMaxBatch / server_->ring_->tick_size()));
  }

  websocket::stream<beast::tcp_stream> stream_;
  Impl* server_;
  beast::flat_buffer buffer_{kMaxHeader + kMaxReceived};
  http::request_parser<http::empty_body> parser_;
  http::response<http::span_body<const char>> response_;
  http::response_serializer<http::span_body<const char>> serializer_{response_};
  std::string text_;
  bool streaming_ = false;
  bool sending_ = false;
  bool sends_text_ = false;  // or sent last
  Clock::time_point send_start_;
  int64_t next_ = 0;  // tick
  std::shared_ptr<const std::string> outgoing_;
  std::shared_ptr<const std::string> sent_state_;
  std::shared_ptr<const std::string> sent_status_;
  std::shared_ptr<const std::string> sent_acts_;
  const Clock::time_point came_ = Clock::now();
  double allowance_ = kActBurst;  // texts
  Clock::time_point refilled_ = came_;
};

ViewServer::Impl::Impl(int port, std::string page, const TickRing* ring, ViewControl control)
    : page_(std::move(page)), ring_(ring), control_(std::move(control)) {
  port_ = ListenHere(port, "--port", "choose another, or leave it out", &acceptor_);
  Accept();
}

ViewServer::Impl::~Impl() {
  const auto clients = clients_;
  for (const auto& client : clients) client->Close();
}

std::string ViewServer::Impl::url() const {
  return fmt::format("http://127.0.0.1:{}/{}{}", port_,
                     control_.token.empty() ? "" : "?token=", control_.token);
}

void ViewServer::Impl::Wait(std::chrono::milliseconds duration) {
  accept_timer_.expires_after(duration);
  accept_timer_.async_wait([this](ErrorCode) { Accept(); });
}

void ViewServer::Impl::Accept() {
  acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
    if (error) {
      Wait(kAcceptPause);
      return;
    }
    Admit(std::move(socket));
    const auto now = Clock::now();
    if (now > window_ + kAcceptWindow) {
      window_ = now;
      accepted_ = 0;
    }
    if (++accepted_ < kMaxAccepts) {
      Accept();
    } else {
      Wait(kAcceptWindow);
    }
  });
}

size_t ViewServer::Impl::streams() const {
  return static_cast<size_t>(std::count_if(clients_.begin(), clients_.end(),
                                           [](const auto& c) { return c->streaming(); }));
}

/// Where all places are taken, the one that has been there longest without streaming makes room.
void ViewServer::Impl::Admit(tcp::socket socket) {
  while (clients_.size() >= kMaxConnections) {
    std::shared_ptr<Client> oldest;
    for (const auto& client : clients_) {
      if (!client->streaming() && (!oldest || client->came() < oldest->came())) oldest = client;
    }
    if (!oldest) return;  // the socket closes
    oldest->Close();
  }
  const auto client = std::make_shared<Client>(std::move(socket), this);
  clients_.insert(client);
  client->Start();
}

void ViewServer::Impl::SendTicks() {
  const auto clients = clients_;  // one may end meanwhile
  for (const auto& client : clients) client->SendTicks();
}

void ViewServer::Impl::SetState(std::string json) {
  if (json != *state_) state_ = std::make_shared<const std::string>(std::move(json));
}

void ViewServer::Impl::SetStatus(std::string json) {
  status_ = std::make_shared<const std::string>(std::move(json));
}

void ViewServer::Impl::SetControl(std::string json) {
  acts_ = std::make_shared<const std::string>(std::move(json));
}

void ViewServer::Impl::Restart() {
  batch_from_ = batch_to_ = -1;
  for (const auto& client : clients_) client->Restart();
}

std::shared_ptr<const std::string> ViewServer::Impl::Batch(int64_t from, int64_t to) {
  if (from != batch_from_ || to != batch_to_) {
    batch_ = std::make_shared<const std::string>(ring_->Encode(from, to, Seconds()));
    batch_from_ = from;
    batch_to_ = to;
  }
  return batch_;
}

ViewServer::ViewServer(int port, std::string page, const TickRing* ring, ViewControl control)
    : impl_(std::make_unique<Impl>(port, std::move(page), ring, std::move(control))) {}
ViewServer::~ViewServer() = default;
int ViewServer::port() const { return impl_->port(); }
std::string ViewServer::url() const { return impl_->url(); }
void ViewServer::SetControl(std::string json) { impl_->SetControl(std::move(json)); }
void ViewServer::Restart() { impl_->Restart(); }
void ViewServer::RunFor(std::chrono::milliseconds duration) { impl_->RunFor(duration); }
int64_t ViewServer::dropped() const { return impl_->dropped(); }
void ViewServer::SendTicks() { impl_->SendTicks(); }
void ViewServer::SetState(std::string json) { impl_->SetState(std::move(json)); }
void ViewServer::SetStatus(std::string json) { impl_->SetStatus(std::move(json)); }

}  // namespace poise
