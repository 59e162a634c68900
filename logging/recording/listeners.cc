#include "logging/recording/listeners.h"

#include <charconv>
#include <cstdint>
#include <fstream>

namespace poise::logging {

// A line is "  sl: ADDRESS:PORT REMOTE:PORT ...", in hexadecimal digits.
bool AnyoneListens(std::string_view url, const std::string& table) {
  if (!url.ends_with("?ttl=0")) return true;
  uint16_t port = 0;
  std::from_chars(url.data() + url.rfind(':') + 1, url.data() + url.size(), port);
  std::ifstream in(table);
  std::string line;
  if (!std::getline(in, line)) return true;  // its heading
  while (std::getline(in, line)) {
    const size_t number_end = line.find(": ");
    if (number_end == std::string::npos) continue;
    const size_t colon = line.find(':', number_end + 2);
    if (colon == std::string::npos) continue;
    uint16_t bound = 0;
    const std::string_view digits = std::string_view(line).substr(colon + 1, 4);
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), bound, 16);
    if (error == std::errc() && bound == port) return true;
  }
  return false;
}

}  // namespace poise::logging
