#include "tools/run/loopback.h"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <cctype>
#include <cstdint>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

/// `a` and `b` but for upper and lower case of ASCII.
bool SameHost(std::string_view a, std::string_view b) {
  return boost::beast::iequals({a.data(), a.size()}, {b.data(), b.size()});
}

}  // namespace

int ListenHere(int port, std::string_view flag, std::string_view advice,
               boost::asio::ip::tcp::acceptor* acceptor) {
  using boost::asio::ip::tcp;
  try {
    const tcp::endpoint endpoint(boost::asio::ip::address_v4::loopback(),
                                 static_cast<uint16_t>(port));
    acceptor->open(endpoint.protocol());
    acceptor->set_option(tcp::acceptor::reuse_address(true));
    acceptor->bind(endpoint);
    acceptor->listen();
    return acceptor->local_endpoint().port();
  } catch (const boost::system::system_error& error) {
    throw ConfigError(fmt::format("{} {}: cannot be had on 127.0.0.1: {}; {}", flag, port,
                                  error.code().message(), advice));
  }
}

bool IsHere(std::string_view host, int port) {
  for (const char* name : {"127.0.0.1", "localhost"}) {
    if (SameHost(host, fmt::format("{}:{}", name, port))) return true;
    if (port == 80 && SameHost(host, name)) return true;
  }
  return false;
}

bool IsWebSocketKey(std::string_view key) {
  constexpr size_t kDigits = 22;
  return key.size() == kDigits + 2 && key.ends_with("==") &&
         std::all_of(key.begin(), key.begin() + kDigits,
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '/'; });
}

bool IsOriginHere(std::string_view origin, int port) {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && IsHere(origin.substr(kScheme.size()), port);
}

}  // namespace poise
