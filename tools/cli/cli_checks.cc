#include "tools/cli/cli_checks.h"

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <system_error>

#include "fmt/format.h"

namespace poise {

std::function<std::string(const std::string&)> Within(const char* range, bool (*good)(double)) {
  return [=](const std::string& text) -> std::string {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool number = !text.empty() && *end == '\0';
    return number && good(value) ? "" : fmt::format("{}: must be {}", text, range);
  };
}

std::function<std::string(const std::string&)> Whole() {
  return [](const std::string& text) -> std::string {
    uint64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc() && stop == end) return "";
    return fmt::format("{}: must be a whole number, 0 or more{}", text,
                       error == std::errc::result_out_of_range ? ", below 2^64" : "");
  };
}

}  // namespace poise
