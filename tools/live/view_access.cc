#include "tools/live/view_access.h"

#include <sys/random.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "fmt/format.h"
#include "tools/cli/lists.h"

namespace poise {
std::optional<ViewTarget> ReadTarget(std::string_view target) {
  ViewTarget read;
  bool token = false;
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
    if (key == "token") {
      if (std::exchange(token, true)) return {};
      read.token = value;
    }
    if (key != "from" && key != "before") continue;
    const std::optional<int64_t> tick = NumberIn<int64_t>(value);
    if (!tick || *tick < 0) return {};
    (key == "from" ? read.from : read.before) = *tick;
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
