// Servers for this machine alone: their sockets, and which requests are this machine's own.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/field.hpp>
#include <string_view>

namespace poise {

/// Opens `acceptor` on `port` of 127.0.0.1, 0: a free one; the port it has. Throws ConfigError,
/// which begins with `flag` and ends with `advice`.
int ListenHere(int port, std::string_view flag, std::string_view advice,
               boost::asio::ip::tcp::acceptor* acceptor);

/// "127.0.0.1:PORT" or "localhost:PORT": a page of another site that has its name resolve to this
/// machine sends its own.
bool IsHere(std::string_view host, int port);
/// "http://" before one of these.
bool IsOriginHere(std::string_view origin, int port);

/// Whether a request's fields of which there may be but one are no more: where it goes and comes
/// from must not depend on who reads it (RFC 9112, 3.2).
template <class Request>
bool IsUnambiguous(const Request& request) {
  namespace http = boost::beast::http;
  return request.count(http::field::host) <= 1 && request.count(http::field::origin) <= 1 &&
         request.count(http::field::sec_websocket_key) <= 1;
}
/// A key of WebSocket's handshake: 16 bytes in base64 (RFC 6455, 4.2.1).
bool IsWebSocketKey(std::string_view key);

}  // namespace poise
