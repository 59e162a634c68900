#include "lcmtypes/field_table.h"

#include <algorithm>

namespace poise {

const FieldInfo* FirstField(std::string_view type, std::string_view path) {
  const std::string_view name = path.substr(0, path.find_first_of(".["));
  const std::span<const FieldInfo> fields = FieldsOf(type);
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const FieldInfo& f) { return name == f.name; });
  return found != fields.end() ? &*found : nullptr;
}

std::string_view UnitOf(std::string_view type, std::string_view path) {
  const FieldInfo* const field = FirstField(type, path);
  if (field == nullptr) return "";
  const size_t dot = path.find('.');
  return dot == std::string_view::npos ? field->unit : UnitOf(field->type, path.substr(dot + 1));
}

}  // namespace poise
