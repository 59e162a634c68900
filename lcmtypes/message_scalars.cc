#include "lcmtypes/message_scalars.h"

#include <cmath>
#include <utility>

namespace poise {
namespace {

class Collect final : public ScalarVisitor {
 public:
  void Integer(std::string_view path, int64_t value) override { Add(path, value); }
  void Real(std::string_view path, double value) override { Add(path, value); }
  void Text(std::string_view path, std::string_view value) override {
    Add(path, std::string(value));
  }
  std::vector<MessageScalar> all;

 private:
  void Add(std::string_view path, std::variant<int64_t, double, std::string> value) {
    all.push_back({std::string(path), std::move(value)});
  }
};

class FiniteCheck final : public ScalarVisitor {
 public:
  void Integer(std::string_view, int64_t) override {}
  void Real(std::string_view, double value) override { finite = finite && std::isfinite(value); }
  void Text(std::string_view, std::string_view) override {}
  bool finite = true;
};

}  // namespace

std::optional<std::vector<MessageScalar>> ScalarsOf(const MessageType& type,
                                                    std::span<const uint8_t> data) {
  Collect collect;
  if (!type.visit(data.data(), static_cast<int64_t>(data.size()), &collect)) return {};
  return std::move(collect.all);
}

bool AllFinite(const MessageType& type, std::span<const uint8_t> data) {
  FiniteCheck check;
  return type.visit(data.data(), static_cast<int64_t>(data.size()), &check) && check.finite;
}

}  // namespace poise
