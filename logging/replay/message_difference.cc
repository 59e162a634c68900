#include "logging/replay/message_difference.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <variant>

#include "fmt/format.h"
#include "lcmtypes/message_scalars.h"

namespace poise::logging {
namespace {

bool SameBits(const MessageScalar& a, const MessageScalar& b) {
  const double* const x = std::get_if<double>(&a.value);
  const double* const y = std::get_if<double>(&b.value);
  if (x == nullptr || y == nullptr) return a.value == b.value;
  return std::bit_cast<uint64_t>(*x) == std::bit_cast<uint64_t>(*y);
}

std::string Digits(const MessageScalar& scalar) {
  if (const auto* text = std::get_if<std::string>(&scalar.value)) return *text;
  if (const auto* real = std::get_if<double>(&scalar.value)) return fmt::format("{:.17g}", *real);
  return fmt::format("{}", std::get<int64_t>(scalar.value));
}

double Size(const MessageScalar& a, const MessageScalar& b) {
  if (std::holds_alternative<std::string>(a.value)) return 1;
  const auto number = [](const MessageScalar& s) {
    const double* const real = std::get_if<double>(&s.value);
    return real != nullptr ? *real : static_cast<double>(std::get<int64_t>(s.value));
  };
  const double size = std::abs(number(a) - number(b));
  return std::isfinite(size) ? size : std::numeric_limits<double>::infinity();
}

}  // namespace

bool SameBits(const MessageType& type, std::span<const uint8_t> a, std::span<const uint8_t> b) {
  const auto run_id = static_cast<size_t>(type.run_id_offset);
  return a.size() == b.size() && a.size() >= run_id + 8 &&
         std::memcmp(a.data(), b.data(), run_id) == 0 &&
         std::memcmp(a.data() + run_id + 8, b.data() + run_id + 8, a.size() - run_id - 8) == 0;
}

std::optional<std::vector<ScalarDifference>> DifferingScalars(const MessageType& type,
                                                              std::span<const uint8_t> a,
                                                              std::span<const uint8_t> b) {
  const auto first = ScalarsOf(type, a), second = ScalarsOf(type, b);
  if (!first || !second || first->size() != second->size()) return {};
  std::vector<ScalarDifference> differences;
  for (size_t i = 0; i < first->size(); ++i) {
    const MessageScalar& x = (*first)[i];
    const MessageScalar& y = (*second)[i];
    if (x.path == "run_id" || SameBits(x, y)) continue;
    differences.push_back({x.path, Digits(x), Digits(y), Size(x, y)});
  }
  return differences;
}

}  // namespace poise::logging
