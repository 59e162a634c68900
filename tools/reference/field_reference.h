// Every field of Poise's files with type, default, unit and meaning, from the schemas and their
// comments.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace poise {

/// A kind of file that users write.
enum class Schema { kScenario, kRobot, kSweep, kGraph };

struct FieldEntry {
  std::string path;           ///< as --set takes it, [i] for a list's index: "sim.push[i].peak"
  std::string type;           ///< "number", "text", "list of groups", ...
  std::string default_value;  ///< as a file has it; empty: none
  std::string unit;           ///< empty: none
  std::string meaning;        ///< one line
  std::vector<std::pair<std::string, std::string>> values;  ///< of an enum: name, meaning
  bool group = false;  ///< holds fields, which follow, and cannot be set itself
};

/// All fields in the schema's order, each group before its fields. What Poise itself writes into a
/// file (Scenario.applied) is left out.
std::vector<FieldEntry> FieldReference(Schema schema);

/// The fields at and below the path `beginning` ("sim.push", "sim.push[0]", "sim."); if
/// there are none, those whose name holds it. Empty: all. Throws ConfigError with near names when
/// nothing fits.
std::vector<FieldEntry> SelectFields(const std::vector<FieldEntry>& fields,
                                     std::string_view beginning);

/// The unit that begins a comment, and the rest: {"N·m", "at the joint"} of "N·m at the joint";
/// {"", comment} when none does.
std::pair<std::string, std::string> SplitUnit(std::string_view comment);

}  // namespace poise
