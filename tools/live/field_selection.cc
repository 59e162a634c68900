#include "tools/live/field_selection.h"

#include <algorithm>
#include <iterator>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "lcmtypes/message_scalars.h"
#include "tools/reference/value_names.h"

namespace poise {
namespace {

/// True when `path` is `field` or lies inside it.
bool Inside(std::string_view path, std::string_view field) {
  if (!path.starts_with(field)) return false;
  return field.empty() || path.size() == field.size() || path[field.size()] == '.' ||
         path[field.size()] == '[';
}

/// The first step of a path: "[3]", or a name.
std::string_view FirstStep(std::string_view path) {
  const size_t end = path.find_first_of(".[", path.starts_with('[') ? 1 : 0);
  return path.substr(0, end);
}

/// `path` without the part `field` that it lies inside.
std::string_view Rest(std::string_view path, std::string_view field) {
  path.remove_prefix(field.size());
  if (path.starts_with('.')) path.remove_prefix(1);
  return path;
}

bool AnyInside(const std::vector<Scalar>& scalars, std::string_view field) {
  return std::any_of(scalars.begin(), scalars.end(),
                     [&](const Scalar& scalar) { return Inside(scalar.path, field); });
}

/// What is wrong with a field that selects nothing.
std::string Problem(const MessageType& type, const std::vector<Scalar>& scalars,
                    std::string_view field) {
  // The longest part of it that exists.
  std::string_view known = field;
  do {
    const size_t cut = known.find_last_of(".[");
    known = known.substr(0, cut == std::string_view::npos ? 0 : cut);
  } while (!known.empty() && !AnyInside(scalars, known));
  const std::string_view wrong = Rest(field, known);

  std::vector<std::string> parts;
  for (const Scalar& scalar : scalars) {
    if (!Inside(scalar.path, known)) continue;
    const std::string_view part = FirstStep(Rest(scalar.path, known));
    if (!part.empty() && std::find(parts.begin(), parts.end(), part) == parts.end()) {
      parts.emplace_back(part);
    }
  }
  if (parts.empty()) {
    return fmt::format("{} is a single value; leave out '{}'", known, field.substr(known.size()));
  }
  if (parts.front().starts_with('[')) {
    const size_t end = wrong.find(']');
    const bool named = parts.front().find_first_not_of("[]0123456789") != std::string::npos;
    if (named && wrong.starts_with('[') && end != std::string_view::npos) {
      std::vector<std::string> names;
      for (const std::string& part : parts) names.push_back(part.substr(1, part.size() - 2));
      const std::string_view element = wrong.substr(1, end - 1);
      std::vector<std::string> holding;  // "knee" means one of the knees
      std::copy_if(
          names.begin(), names.end(), std::back_inserter(holding),
          [&](const std::string& name) { return name.find(element) != std::string::npos; });
      if (!element.empty() && !holding.empty()) names = std::move(holding);
      return fmt::format("{} has no element '{}'; {}", known, element, Suggest(element, names));
    }
    return fmt::format("{} is an array of {}; write {}{}{} or {}", known, parts.size(), known,
                       parts.front(),
                       parts.size() > 1 ? fmt::format(" to {}{}", known, parts.back()) : "", known);
  }
  return fmt::format("{} has no field '{}'; {}", known.empty() ? type.name : known,
                     wrong.substr(0, wrong.find_first_of(wrong.starts_with('[') ? "." : ".[")),
                     Suggest(FirstStep(wrong), parts));
}

}  // namespace

std::optional<std::vector<Scalar>> ReadScalars(const MessageType& type,
                                               std::span<const uint8_t> data,
                                               const logging::ElementNames& names) {
  std::optional<std::vector<MessageScalar>> read = ScalarsOf(type, data);
  if (!read) return std::nullopt;
  std::vector<Scalar> scalars;
  for (auto& [path, value] : *read) {
    const int64_t* const number = std::get_if<int64_t>(&value);
    scalars.push_back({names.Label(type.name, path), value,
                       number == nullptr ? "" : ValueName(type.name, path, *number)});
  }
  return scalars;
}

std::vector<uint8_t> ZeroMessage(const MessageType& type, std::span<const int32_t> counts) {
  std::vector<uint8_t> data(static_cast<size_t>(type.encoded_size(counts)));
  const auto write = [&](size_t at, uint64_t value, size_t bytes) {
    for (size_t i = 0; i < bytes; ++i) {
      data[at + i] = static_cast<uint8_t>(value >> (8 * (bytes - 1 - i)));
    }
  };
  write(0, static_cast<uint64_t>(type.fingerprint), 8);
  for (size_t i = 0; i < counts.size(); ++i) {
    write(8 + 4 * i, static_cast<uint32_t>(counts[i]), 4);
  }
  return data;
}

void FieldSelection::UseNames(const MessageType& type, const logging::ElementNames& names) {
  for (std::string& field : fields_) field = names.Label(type.name, field);
}

void FieldSelection::Check(const MessageType& type, const std::vector<Scalar>& scalars) const {
  for (const std::string& field : fields_) {
    if (field.empty() || !AnyInside(scalars, field)) {
      throw ConfigError(field, Problem(type, scalars, field));
    }
  }
}

std::vector<Scalar> FieldSelection::Pick(const std::vector<Scalar>& scalars) const {
  if (all()) return scalars;
  std::vector<Scalar> picked;
  for (const std::string& field : fields_) {
    std::copy_if(scalars.begin(), scalars.end(), std::back_inserter(picked),
                 [&](const Scalar& scalar) { return Inside(scalar.path, field); });
  }
  return picked;
}

}  // namespace poise
