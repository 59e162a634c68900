#include "tools/run/local_server.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr uint32_t kMaxHeader = 16 << 10;  // bytes; browsers send about 1 KB
constexpr int kMaxAccepts = 200;           // in each kAcceptWindow: 2,000/s
constexpr std::chrono::milliseconds kAcceptWindow{100};
constexpr std::chrono::milliseconds kAcceptPause{100};  // when the system has no more sockets
constexpr int kSendBuffer = 256 << 10;                  // bytes, in the system
constexpr std::chrono::seconds kPatience{5};

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }
beast::string_view BeastView(std::string_view text) { return {text.data(), text.size()}; }

/// `a` and `b` but for upper and lower case of ASCII.
bool SameHost(std::string_view a, std::string_view b) {
  return beast::iequals(BeastView(a), BeastView(b));
}

/// A key of WebSocket's handshake: 16 bytes in base64 (RFC 6455, 4.2.1).
bool IsWebSocketKey(std::string_view key) {
  constexpr size_t kDigits = 22;
  return key.size() == kDigits + 2 && key.ends_with("==") &&
         std::all_of(key.begin(), key.begin() + kDigits,
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '/'; });
}

}  // namespace

bool IsHere(std::string_view host, int port) {
  for (const char* name : {"127.0.0.1", "localhost"}) {
    if (SameHost(host, fmt::format("{}:{}", name, port))) return true;
    if (port == 80 && SameHost(host, name)) return true;
  }
  return false;
}

bool IsOriginHere(std::string_view origin, int port) {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && IsHere(origin.substr(kScheme.size()), port);
}

LocalClient::LocalClient(tcp::socket socket, LocalServer* server, size_t most_received)
    : stream_(std::move(socket)),
      server_(server),
      most_received_(most_received),
      buffer_(kMaxHeader + most_received) {}

void LocalClient::Start() {
  ErrorCode ignored;  // the default size does as well
  Socket().socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  parser_.header_limit(kMaxHeader);
  Socket().expires_after(kPatience);
  http::async_read(
      Socket(), buffer_, parser_, [self = shared_from_this()](ErrorCode error, size_t) {
        if (!error) {
          self->Check();
        } else if (error.category() ==
                       http::make_error_code(http::error::end_of_stream).category() &&
                   error != http::error::end_of_stream && error != http::error::partial_message) {
          self->Refuse(Status::bad_request, "no request that is understood here\n");
        } else {
          self->Close();
        }
      });
}

void LocalClient::Check() {
  const Request& request = parser_.get();
  // Each of these headers may come once: where a request goes and comes from must not depend on who
  // reads it (RFC 9112, 3.2).
  const bool ambiguous = request.count(http::field::host) > 1 ||
                         request.count(http::field::origin) > 1 ||
                         request.count(http::field::sec_websocket_key) > 1;
  const auto origin = request.find(http::field::origin);
  std::string foreign;
  if (!IsHere(View(request[http::field::host]), server_->port())) {
    foreign = fmt::format("only for 127.0.0.1:{}\n", server_->port());
  } else if (origin != request.end()) {
    foreign = server_->WhyForeign(View(origin->value()));
  }
  if (ambiguous) {
    Refuse(Status::bad_request, "one Host and one Origin at most\n");
  } else if (!foreign.empty()) {
    Refuse(Status::forbidden, std::move(foreign));
  } else {
    Answer(request);
  }
}

void LocalClient::Refuse(Status status, std::string text) {
  Respond(status, std::make_shared<const std::string>(std::move(text)),
          "text/plain; charset=utf-8");
}

void LocalClient::Respond(Status status, Text body, std::string_view type) {
  body_ = std::move(body);
  response_.result(status);
  response_.version(11);
  response_.keep_alive(false);
  response_.set(http::field::content_type, BeastView(type));
  response_.set(http::field::cache_control, "no-store");
  response_.set(http::field::x_frame_options, "DENY");
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("Cross-Origin-Resource-Policy", "same-origin");
  response_.set("Referrer-Policy", "no-referrer");  // the address may hold a token
  if (status == Status::method_not_allowed) response_.set(http::field::allow, "GET, HEAD");
  if (status == Status::upgrade_required) response_.set(http::field::upgrade, "websocket");
  response_.body() = beast::span<const char>(body_->data(), body_->size());
  response_.content_length(body_->size());
  Socket().expires_after(kPatience);
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

void LocalClient::Upgrade(std::string_view protocol) {
  if (!IsWebSocketKey(View(parser_.get()[http::field::sec_websocket_key]))) {
    return Refuse(Status::bad_request, "Sec-WebSocket-Key is not 16 bytes in base64\n");
  }
  Socket().expires_never();  // the stream has times of its own
  websocket::stream_base::timeout times{};
  times.handshake_timeout = kPatience;
  times.idle_timeout = 4 * kPatience;  // pings in between: half-open ones end
  times.keep_alive_pings = true;
  stream_.set_option(times);
  stream_.set_option(websocket::stream_base::decorator(
      [protocol = std::string(protocol)](websocket::response_type& response) {
        if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
      }));
  stream_.read_message_max(most_received_);
  stream_.write_buffer_bytes(64 << 10);
  stream_.auto_fragment(false);
  stream_.async_accept(parser_.get(), [self = shared_from_this()](ErrorCode error) {
    if (error || self->closed_) return self->Close();
    self->streaming_ = true;
    self->buffer_.clear();
    self->Opened();
    self->Receive();
  });
}

void LocalClient::Receive() {
  if (reading_ || closed_ || !Reads()) return;
  reading_ = true;
  stream_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, size_t) {
    self->reading_ = false;
    const auto bytes = self->buffer_.cdata();
    if (error || self->closed_ ||
        !self->Take({static_cast<const char*>(bytes.data()), bytes.size()},
                    self->stream_.got_text())) {
      return self->Close();
    }
    self->buffer_.clear();
    self->Receive();
  });
}

void LocalClient::Write(std::string head, Text rest, bool text) {
  writing_ = true;
  write_start_ = Clock::now();
  head_ = std::move(head);
  rest_ = std::move(rest);
  stream_.text(text);
  const std::array<asio::const_buffer, 2> buffers = {
      asio::buffer(head_), rest_ ? asio::buffer(*rest_) : asio::const_buffer()};
  stream_.async_write(buffers, [self = shared_from_this()](ErrorCode error, size_t) {
    self->writing_ = false;
    if (error || self->closed_) return self->Close();
    self->Written();
  });
}

bool LocalClient::stuck() const { return writing_ && Clock::now() > write_start_ + kPatience; }

void LocalClient::Close() {
  closed_ = true;
  streaming_ = false;
  ErrorCode ignored;
  Socket().socket().close(ignored);
  server_->clients_.erase(shared_from_this());
}

LocalServer::LocalServer(int port, std::string_view flag, std::string_view advice,
                         size_t most_clients)
    : most_clients_(most_clients) {
  try {
    const tcp::endpoint endpoint(asio::ip::address_v4::loopback(), static_cast<uint16_t>(port));
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
    port_ = acceptor_.local_endpoint().port();
  } catch (const boost::system::system_error& error) {
    throw ConfigError(fmt::format("{} {}: cannot be had on 127.0.0.1: {}; {}", flag, port,
                                  error.code().message(), advice));
  }
  Accept();
}

LocalServer::~LocalServer() {
  const auto all = clients_;
  for (const auto& client : all) client->Close();
}

void LocalServer::AcceptAfter(std::chrono::milliseconds duration) {
  accept_timer_.expires_after(duration);
  accept_timer_.async_wait([this](ErrorCode) { Accept(); });
}

void LocalServer::Accept() {
  acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
    if (error) return AcceptAfter(kAcceptPause);
    Admit(std::move(socket));
    const auto now = LocalClient::Clock::now();
    if (now > window_ + kAcceptWindow) {
      window_ = now;
      accepted_ = 0;
    }
    if (++accepted_ < kMaxAccepts) {
      Accept();
    } else {
      AcceptAfter(kAcceptWindow);
    }
  });
}

void LocalServer::Admit(tcp::socket socket) {
  while (clients_.size() >= most_clients_) {
    std::shared_ptr<LocalClient> oldest;
    for (const auto& client : clients_) {
      if (!client->streaming() && (!oldest || client->came() < oldest->came())) oldest = client;
    }
    if (!oldest) return;  // the socket closes
    oldest->Close();
  }
  const std::shared_ptr<LocalClient> client = MakeClient(std::move(socket));
  clients_.insert(client);
  client->Start();
}

}  // namespace poise
