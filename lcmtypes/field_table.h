// What the .lcm files say of the fields of messages and of the structs in them.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/message_fields.h"

namespace poise {

struct FieldInfo {
  const char* name;
  const char* type;   ///< "double", "wrench_t"
  const char* count;  ///< that sizes the array, e.g. "num_joints"; "": of fixed size, or no array
  const char* unit;   ///< that the field's comment begins with, e.g. "N·m"; "": it has none
  int length;         ///< of an array of fixed size; 0: it is none
};

struct StructInfo {
  const char* name;  ///< as MessageType::name
  std::span<const FieldInfo> fields;
};

/// All that a set of .lcm files tells at run time. Generated, a function NAME_messages() a set.
struct MessageSet {
  std::span<const MessageType> types;
  std::span<const StructInfo> structs;       ///< of messages, and of their fields
  std::span<const char* const> definitions;  ///< the files' texts
};

/// Makes the messages of a set known, before anything asks for them: MessageTypes. Returns true; a
/// name or fingerprint that is taken is left out, and MessageProblems() tells.
bool AddMessages(const MessageSet& set);
/// A line each; empty: none.
const std::vector<std::string>& MessageProblems();
/// The texts of all .lcm files.
const std::vector<std::string_view>& MessageDefinitions();

/// In order of declaration; none when there is no such type.
std::span<const FieldInfo> FieldsOf(std::string_view type);

/// The field at the beginning of `path` ("foot_wrench" of "foot_wrench[1].force[2]"); nullptr when
/// the type has none of that name.
const FieldInfo* FirstField(std::string_view type, std::string_view path);

/// Unit of the scalar at a path like "foot_wrench[1].force[2]"; empty when it has none.
std::string_view UnitOf(std::string_view type, std::string_view path);

}  // namespace poise
