// Servers for this machine alone: their sockets, and which requests are this machine's own.
#pragma once

#include <boost/asio/ip/tcp.hpp>
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

}  // namespace poise
