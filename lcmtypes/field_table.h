// What the .lcm files say of the fields of messages and of the structs in them.
#pragma once

#include <span>
#include <string_view>

namespace poise {

struct FieldInfo {
  const char* name;
  const char* type;   ///< "double", "wrench_t"
  const char* count;  ///< that sizes the array, e.g. "num_joints"; "": of fixed size, or no array
  const char* unit;   ///< that the field's comment begins with, e.g. "N·m"; "": it has none
};

/// In order of declaration; none when there is no such type. Generated.
std::span<const FieldInfo> FieldsOf(std::string_view type);

/// The field at the beginning of `path` ("foot_wrench" of "foot_wrench[1].force[2]"); nullptr when
/// the type has none of that name.
const FieldInfo* FirstField(std::string_view type, std::string_view path);

/// Unit of the scalar at a path like "foot_wrench[1].force[2]"; empty when it has none.
std::string_view UnitOf(std::string_view type, std::string_view path);

}  // namespace poise
