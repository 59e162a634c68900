#include "tools/live/view_access.h"

#include <sys/random.h>

#include <array>
#include <boost/beast/core/string.hpp>
#include <cerrno>
#include <charconv>
#include <system_error>

#include "fmt/format.h"

namespace poise {
namespace {

/// `a` and `b` but for upper and lower case of ASCII.
bool SameHost(std::string_view a, std::string_view b) {
  return boost::beast::iequals({a.data(), a.size()}, {b.data(), b.size()});
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

std::optional<ViewTarget> ReadTarget(std::string_view target) {
  ViewTarget read;
  const size_t question = target.find('?');
  read.path = target.substr(0, question);
  std::string_view rest = question == target.npos ? "" : target.substr(question + 1);
  while (!rest.empty()) {
    const size_t end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    rest = end == rest.npos ? "" : rest.substr(end + 1);
    const size_t equals = pair.find('=');
    if (equals == pair.npos) continue;
    const std::string_view key = pair.substr(0, equals), value = pair.substr(equals + 1);
    if (key == "token") read.token = value;
    if (key != "from") continue;
    const char* const last = value.data() + value.size();
    const auto [parsed, error] = std::from_chars(value.data(), last, read.from);
    if (error != std::errc() || parsed != last || read.from < 0) return {};
  }
  return read;
}

std::string MakeToken() {
  std::array<uint8_t, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "no random numbers for a token");
  }
  std::string token;
  for (const uint8_t byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

bool SameToken(std::string_view given, std::string_view token) {
  if (given.size() != token.size()) return false;
  unsigned difference = 0;
  for (size_t i = 0; i < token.size(); ++i) {
    difference |= static_cast<unsigned>(given[i]) ^ static_cast<unsigned>(token[i]);
  }
  return difference == 0;
}

}  // namespace poise
