// Every field of a file or a configuration with type, default, unit and meaning, from the schemas
// and their comments.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace poise {

struct FieldEntry {
  std::string path;           ///< as --set takes it, [i] for a list's index: "sim.push[i].peak"
  std::string type;           ///< "number", "text", "list of groups", ...
  std::string default_value;  ///< as a file has it; empty: none
  std::string unit;           ///< empty: none
  std::string range;          ///< what its rule allows, "0 or more"; empty: any
  std::string meaning;        ///< one line, the comment as it stands: it begins with the unit
  std::vector<std::pair<std::string, std::string>> values;  ///< of an enum: name, meaning
  bool group = false;  ///< holds fields, which follow, and cannot be set itself
};

/// Makes the types of a serialised FileDescriptorSet known, with the comments that compiled classes
/// lack. Files that are known are passed over. Throws std::logic_error when it is none.
void AddSchema(std::string_view descriptor_set);

/// All fields of a known type ("poise.Scenario") in the schema's order, each group before its
/// fields, paths after `prefix`. What Poise itself writes into a file (Scenario.applied) is left
/// out.
std::vector<FieldEntry> FieldsOfType(const std::string& type, const std::string& prefix = "");

/// The entry of a group of that type which stands under the name `path`, then its fields.
std::vector<FieldEntry> FieldsOfGroup(const std::string& type, const std::string& path);

/// The fields at and below the path `beginning` ("sim.push", "sim.push[0]", "sim."); if
/// there are none, those whose name holds it. Empty: all. Throws ConfigError with near names when
/// nothing fits.
std::vector<FieldEntry> SelectFields(const std::vector<FieldEntry>& fields,
                                     std::string_view beginning);

/// The unit that begins a comment, "N·m" of "N·m at the joint"; empty when none does.
std::string UnitOf(std::string_view comment);

}  // namespace poise
