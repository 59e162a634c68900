#include "python/message_layout.h"

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cstring>
#include <map>
#include <utility>

namespace poise::python {
namespace {

const std::map<std::string_view, Number>& Numbers() {
  static const std::map<std::string_view, Number> numbers = {
      {"int8_t", Number::kInt8},   {"byte", Number::kUint8},    {"boolean", Number::kInt8},
      {"int16_t", Number::kInt16}, {"int32_t", Number::kInt32}, {"int64_t", Number::kInt64},
      {"float", Number::kFloat},   {"double", Number::kDouble}};
  return numbers;
}

/// Calls `visit` with an unsigned number of the size of the leaf's.
template <class Visit>
void WithWord(const Leaf& leaf, const Visit& visit) {
  switch (SizeOf(leaf.number)) {
    case 1:
      return visit(uint8_t{});
    case 2:
      return visit(uint16_t{});
    case 4:
      return visit(uint32_t{});
    default:
      return visit(uint64_t{});
  }
}

}  // namespace

size_t SizeOf(Number number) {
  constexpr size_t kSizes[] = {1, 1, 2, 4, 8, 4, 8};  // in the order of Number
  return kSizes[static_cast<size_t>(number)];
}

std::vector<std::string> Leaf::Paths() const {
  std::vector<std::string> paths = {""};
  std::string_view rest = path;
  size_t dimension = 0;
  for (const bool array : indexed) {
    const std::string_view name = rest.substr(0, rest.find('.'));
    rest.remove_prefix(std::min(name.size() + 1, rest.size()));
    const int64_t count = array ? shape[dimension++] : 1;
    std::vector<std::string> longer;
    for (const std::string& before : paths) {
      for (int64_t i = 0; i < count; ++i) {
        longer.push_back(before + (before.empty() ? "" : ".") + std::string(name) +
                         (array ? "[" + std::to_string(i) + "]" : ""));
      }
    }
    paths = std::move(longer);
  }
  return paths;
}

MessageLayout::MessageLayout(const MessageType& type, std::span<const int32_t> counts)
    : type_(type.name) {
  for (size_t i = 0; i < type.count_names.size() && i < counts.size(); ++i) {
    counts_.emplace_back(type.count_names[i], counts[i]);
  }
  constexpr size_t kFingerprint = 8;  // bytes before the first field
  Add(type.name, "", {}, {kFingerprint}, {});
  size_ = kFingerprint + EncodedSize(type.name);
}

int64_t MessageLayout::CountOf(const FieldInfo& field) const {
  if (*field.count == '\0') return field.length;
  for (const auto& [name, count] : counts_) {
    if (name == field.count) return count;
  }
  return 0;
}

size_t MessageLayout::EncodedSize(std::string_view type) const {
  size_t size = 0;
  for (const FieldInfo& field : FieldsOf(type)) {
    const auto number = Numbers().find(field.type);
    const size_t one = number != Numbers().end() ? SizeOf(number->second) : EncodedSize(field.type);
    const bool array = *field.count != '\0' || field.length > 0;
    size += one * static_cast<size_t>(array ? CountOf(field) : 1);
  }
  return size;
}

void MessageLayout::Add(std::string_view type, const std::string& prefix,
                        const std::vector<int64_t>& shape, const std::vector<size_t>& bases,
                        const std::vector<bool>& indexed) {
  size_t offset = 0;
  for (const FieldInfo& field : FieldsOf(type)) {
    const auto number = Numbers().find(field.type);
    const bool known = number != Numbers().end();
    const size_t one = known ? SizeOf(number->second) : EncodedSize(field.type);
    const bool array = *field.count != '\0' || field.length > 0;
    const int64_t count = array ? CountOf(field) : 1;
    std::vector<int64_t> inner = shape;
    if (array) inner.push_back(count);
    std::vector<size_t> places;
    for (const size_t base : bases) {
      for (int64_t i = 0; i < count; ++i) {
        places.push_back(base + offset + static_cast<size_t>(i) * one);
      }
    }
    const std::string path = prefix + field.name;
    std::vector<bool> parts = indexed;
    parts.push_back(array);
    if (known) {
      leaves_.push_back({path, number->second, std::move(inner), std::move(places), type_, parts});
    } else {
      Add(field.type, path + ".", inner, places, parts);
    }
    offset += one * static_cast<size_t>(count);
  }
}

const Leaf* MessageLayout::Find(std::string_view path) const {
  const auto found = std::ranges::find(leaves_, path, &Leaf::path);
  return found == leaves_.end() ? nullptr : &*found;
}

void MessageLayout::Read(const Leaf& leaf, const uint8_t* message, void* to) {
  auto* out = static_cast<uint8_t*>(to);
  WithWord(leaf, [&](auto word) {
    for (const size_t at : leaf.elements) {
      std::memcpy(&word, message + at, sizeof(word));
      word = boost::endian::big_to_native(word);
      std::memcpy(out, &word, sizeof(word));
      out += sizeof(word);
    }
  });
}

void MessageLayout::Write(const Leaf& leaf, const void* from, uint8_t* message) {
  const auto* in = static_cast<const uint8_t*>(from);
  WithWord(leaf, [&](auto word) {
    for (const size_t at : leaf.elements) {
      std::memcpy(&word, in, sizeof(word));
      word = boost::endian::native_to_big(word);
      std::memcpy(message + at, &word, sizeof(word));
      in += sizeof(word);
    }
  });
}

}  // namespace poise::python
