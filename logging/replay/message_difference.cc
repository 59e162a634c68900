#include "logging/replay/message_difference.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <variant>

#include "fmt/format.h"

namespace poise::logging {
namespace {

struct Scalar {
  std::string path;
  std::variant<int64_t, double, std::string> value;
};

class Scalars final : public ScalarVisitor {
 public:
  void Integer(std::string_view path, int64_t value) override { Add(path, value); }
  void Real(std::string_view path, double value) override { Add(path, value); }
  void Text(std::string_view path, std::string_view value) override {
    Add(path, std::string(value));
  }
  std::vector<Scalar> all;

 private:
  void Add(std::string_view path, std::variant<int64_t, double, std::string> value) {
    all.push_back({std::string(path), std::move(value)});
  }
};

bool SameBits(const Scalar& a, const Scalar& b) {
  const double* const x = std::get_if<double>(&a.value);
  const double* const y = std::get_if<double>(&b.value);
  if (x == nullptr || y == nullptr) return a.value == b.value;
  return std::bit_cast<uint64_t>(*x) == std::bit_cast<uint64_t>(*y);
}

std::string Digits(const Scalar& scalar) {
  if (const auto* text = std::get_if<std::string>(&scalar.value)) return *text;
  if (const auto* real = std::get_if<double>(&scalar.value)) return fmt::format("{:.17g}", *real);
  return fmt::format("{}", std::get<int64_t>(scalar.value));
}

double Size(const Scalar& a, const Scalar& b) {
  if (std::holds_alternative<std::string>(a.value)) return 1;
  const auto number = [](const Scalar& s) {
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
  Scalars first;
  Scalars second;
  if (!type.visit(a.data(), static_cast<int64_t>(a.size()), &first) ||
      !type.visit(b.data(), static_cast<int64_t>(b.size()), &second) ||
      first.all.size() != second.all.size()) {
    return {};
  }
  std::vector<ScalarDifference> differences;
  for (size_t i = 0; i < first.all.size(); ++i) {
    const Scalar& x = first.all[i];
    const Scalar& y = second.all[i];
    if (x.path == "run_id" || SameBits(x, y)) continue;
    differences.push_back({x.path, Digits(x), Digits(y), Size(x, y)});
  }
  return differences;
}

}  // namespace poise::logging
