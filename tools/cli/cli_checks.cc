#include "tools/cli/cli_checks.h"

#include <cstdlib>

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

}  // namespace poise
