// Writes OUTPUT_DIR/NAME/message_traits.hpp and message_table.cc from the .lcm files of a set of
// messages, and refuses messages that the framework could not check before decoding. A message of
// package poise is called by its struct's name, another one PACKAGE.STRUCT. Usage:
// poise_traits_generator NAME OUTPUT_DIR FILE.lcm ... [--import FILE.lcm ...]
// Imported files give structs for fields, and nothing is written for them.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>

#include "lcmtypes/lcm_parser.h"

namespace poise {
namespace {

const std::map<std::string, int> kScalarSizes = {{"int8_t", 1},  {"byte", 1},    {"boolean", 1},
                                                 {"int16_t", 2}, {"int32_t", 4}, {"int64_t", 8},
                                                 {"float", 4},   {"double", 8}};

/// As messages are called: "robot_state_t", "ankle.sway_t".
std::string FullName(const std::string& package, const std::string& name) {
  return package == "poise" ? name : package + "." + name;
}

/// "a.b.c_t" with `separator` for the dots.
std::string Separated(std::string name, const std::string& separator) {
  for (size_t dot = 0; (dot = name.find('.', dot)) != std::string::npos; dot += separator.size()) {
    name.replace(dot, 1, separator);
  }
  return name;
}

struct Message {
  LcmStruct lcm;  // named in full
  std::vector<std::string> counts;
  bool has_header = false;
  bool has_strings = false;
  std::string name;  // of the struct alone
};

[[noreturn]] void Fail(const LcmStruct& lcm, int line, const std::string& problem) {
  throw std::runtime_error(lcm.file + ":" + std::to_string(line) + ": " + problem);
}

/// Splits off the leading counts and checks the rules of the house.
Message Check(const LcmStruct& lcm, const std::set<std::string>& nested,
              const std::map<std::string, LcmStruct>& all) {
  Message message{lcm, {}, false, false, lcm.name.substr(lcm.name.rfind('.') + 1)};
  std::set<std::string> dimensions;
  for (const LcmField& field : lcm.fields) {
    if (!field.dimension.empty() && !field.literal_dimension()) dimensions.insert(field.dimension);
  }
  size_t at = 0;
  while (at < lcm.fields.size() && lcm.fields[at].type == "int32_t" &&
         lcm.fields[at].dimension.empty() && lcm.fields[at].name.starts_with("num_")) {
    message.counts.push_back(lcm.fields[at++].name);
  }
  for (const LcmField& field : lcm.fields) {
    const bool is_struct = all.contains(field.type);
    if (!is_struct && field.type != "string" && !kScalarSizes.contains(field.type)) {
      Fail(lcm, field.line, "field " + field.name + ": unknown type " + field.type);
    }
    if (field.type == "string") {
      message.has_strings = true;
      if (!field.dimension.empty())
        Fail(lcm, field.line, "field " + field.name + ": arrays of strings are not supported");
    }
    if (!field.dimension.empty() && !field.literal_dimension() &&
        std::find(message.counts.begin(), message.counts.end(), field.dimension) ==
            message.counts.end()) {
      Fail(lcm, field.line,
           "field " + field.name + ": dimension " + field.dimension +
               " must be one of the leading int32_t num_... fields, which are checked before "
               "decoding");
    }
  }
  for (const std::string& count : message.counts) {
    if (!dimensions.contains(count)) Fail(lcm, lcm.line, "count " + count + " sizes no array");
  }
  const char* const header[] = {"run_id", "tick", "utime"};
  message.has_header = at + 3 <= lcm.fields.size();
  for (size_t i = 0; i < 3 && message.has_header; ++i) {
    const LcmField& field = lcm.fields[at + i];
    message.has_header =
        field.type == "int64_t" && field.dimension.empty() && field.name == header[i];
  }
  if (nested.contains(lcm.name)) {
    if (message.has_header || !message.counts.empty() || message.has_strings) {
      Fail(lcm, lcm.line,
           lcm.name + " is a field of another message: it may have no counts, header or strings");
    }
  } else if (!message.has_header) {
    const int line = lcm.fields.size() > at ? lcm.fields[at].line : lcm.line;
    Fail(lcm, line, lcm.name + ": int64_t run_id, tick, utime must follow the counts");
  }
  return message;
}

/// Encoded bytes of one element; for structs the sum over their fields.
int64_t ElementSize(const std::string& type, const std::map<std::string, LcmStruct>& all) {
  const auto scalar = kScalarSizes.find(type);
  if (scalar != kScalarSizes.end()) return scalar->second;
  int64_t size = 0;
  for (const LcmField& field : all.at(type).fields) {
    size += ElementSize(field.type, all) *
            (field.literal_dimension() ? std::stoll(field.dimension) : 1);
  }
  return size;
}

/// Encoded size as an expression of counts[i].
std::string EncodedSizeFormula(const Message& message,
                               const std::map<std::string, LcmStruct>& all) {
  if (message.has_strings) return "-1";
  int64_t fixed = 8;
  std::vector<int64_t> per_count(message.counts.size(), 0);
  for (const LcmField& f : message.lcm.fields) {
    const int64_t size = ElementSize(f.type, all);
    if (f.dimension.empty() || f.literal_dimension()) {
      fixed += size * (f.dimension.empty() ? 1 : std::stoll(f.dimension));
    } else {
      const auto at = std::find(message.counts.begin(), message.counts.end(), f.dimension);
      per_count[static_cast<size_t>(at - message.counts.begin())] += size;
    }
  }
  std::string formula = std::to_string(fixed);
  for (size_t i = 0; i < per_count.size(); ++i) {
    formula +=
        " + " + std::to_string(per_count[i]) + " * int64_t{counts[" + std::to_string(i) + "]}";
  }
  return formula;
}

void WriteTraits(const Message& message, const std::map<std::string, LcmStruct>& all,
                 std::ostream& out) {
  const std::string name = "::" + Separated(message.lcm.package, "::") + "::" + message.name;
  const size_t n = message.counts.size();
  out << "template <>\nstruct MessageTraits<" << name << "> {\n"
      << "  static constexpr const char* kName = \"" << message.lcm.name << "\";\n"
      << "  static constexpr int kNumCounts = " << n << ";\n"
      << "  static constexpr std::array<const char*, " << n << "> kCountNames = {";
  for (size_t i = 0; i < n; ++i) out << (i ? ", " : "") << '"' << message.counts[i] << '"';
  out << "};\n"
      << "  static constexpr bool kHasHeader = " << (message.has_header ? "true" : "false") << ";\n"
      << "  static constexpr bool kHasStrings = " << (message.has_strings ? "true" : "false")
      << ";\n"
      << "  static constexpr int kRunIdOffset = " << 8 + 4 * n << ";  // in the encoded message\n\n"
      << "  // Sets the counts, sizes the arrays and zeroes everything. counts.size() must be "
         "kNumCounts.\n"
      << "  static void Resize(" << name
      << "& m, [[maybe_unused]] std::span<const int32_t> counts) {\n"
      << "    m = " << name << "{};\n";
  const auto index = [&](const std::string& count) {
    return std::find(message.counts.begin(), message.counts.end(), count) - message.counts.begin();
  };
  for (size_t i = 0; i < n; ++i)
    out << "    m." << message.counts[i] << " = counts[" << i << "];\n";
  for (const LcmField& f : message.lcm.fields) {
    if (f.dimension.empty() || f.literal_dimension()) continue;
    out << "    m." << f.name << ".assign(static_cast<size_t>(counts[" << index(f.dimension)
        << "]), {});\n";
  }
  out << "  }\n\n"
      << "  // Calls visit(const char* name, field&) for every field in order; M may be const.\n"
      << "  template <class M, class V>\n  static void VisitFields(M& m, V&& visit) {\n";
  for (const LcmField& f : message.lcm.fields)
    out << "    visit(\"" << f.name << "\", m." << f.name << ");\n";
  out << "  }\n\n"
      << "  static bool AllFinite(const " << name << "& m) {\n    return true";
  for (const LcmField& f : message.lcm.fields) {
    const auto scalar = kScalarSizes.find(f.type);
    const bool real = f.type == "double" || f.type == "float";
    if (real || (scalar == kScalarSizes.end() && f.type != "string")) {
      out << " &&\n           message_internal::AllFinite(m." << f.name << ")";
    }
  }
  out << ";\n  }\n\n"
      << "  // See MessageType::encoded_size.\n"
      << "  static int64_t EncodedSize([[maybe_unused]] std::span<const int32_t> counts) {\n"
      << "    return " << EncodedSizeFormula(message, all) << ";\n  }\n\n"
      << "  // See MessageType::well_formed_size.\n"
      << "  static int64_t WellFormedSize(const uint8_t* data, int64_t size) {\n"
      << "    message_internal::SizeWalker walk(data, size);\n    walk.Skip(8);\n";
  for (const std::string& count : message.counts) {
    out << "    const int64_t " << count << " = walk.Count();\n";
  }
  int64_t fixed = 0;
  const auto flush = [&] {
    if (fixed != 0) out << "    walk.Skip(" << fixed << ");\n";
    fixed = 0;
  };
  for (size_t i = n; i < message.lcm.fields.size(); ++i) {
    const LcmField& f = message.lcm.fields[i];
    if (f.type == "string") {
      flush();
      out << "    walk.String();\n";
      continue;
    }
    const int64_t size = ElementSize(f.type, all);
    if (f.dimension.empty() || f.literal_dimension()) {
      fixed += size * (f.dimension.empty() ? 1 : std::stoll(f.dimension));
    } else {
      flush();
      out << "    walk.Skip(" << size << " * " << f.dimension << ");\n";
    }
  }
  flush();
  out << "    return walk.position();\n  }\n};\n\n";
}

/// The unit that a comment begins with; empty when it begins with none.
std::string UnitOf(const std::string& comment) {
  for (const std::string unit :
       {"m/s^2", "rad/s", "m/s", "N·m", "rad", "us", "m", "N", "A", "s", "%"}) {
    if (!comment.starts_with(unit)) continue;
    if (comment.size() == unit.size() ||
        std::string(",;:( ").find(comment[unit.size()]) != std::string::npos) {
      return unit;
    }
  }
  return "";
}

/// The C++ identifier that stands for a message's name.
std::string Identifier(const Message& message) { return "k_" + Separated(message.lcm.name, "_"); }

void WriteHeader(const std::string& set, const std::vector<Message>& messages,
                 const std::map<std::string, LcmStruct>& all, std::ostream& out) {
  out << "// Generated from .lcm files by poise_traits_generator.\n#pragma once\n\n"
      << "#include <array>\n#include <cstdint>\n#include <span>\n\n"
      << "#include \"lcmtypes/message_fields.h\"\n";
  if (set != "poise") out << "#include \"poise/message_traits.hpp\"\n";
  for (const Message& m : messages) {
    out << "#include \"" << Separated(m.lcm.package, "/") << "/" << m.name << ".hpp\"\n";
  }
  out << "\nnamespace poise {\n\n";
  for (const Message& m : messages) WriteTraits(m, all, out);
  if (set == "poise") {
    out << "// X(T) for every message type of Poise's own that a component's port can carry.\n"
        << "#define POISE_PORT_MESSAGES(X)";
    for (const Message& m : messages) {
      if (m.has_header && !m.has_strings) out << " \\\n  X(" << m.lcm.name << ")";
    }
    out << "\n\n// Calls f.template operator()<T>() for every message type of Poise's own with a "
           "header.\n"
        << "template <class F>\nvoid ForEachMessageType(F&& f) {\n";
    for (const Message& m : messages) {
      if (m.has_header) out << "  f.template operator()<" << m.lcm.name << ">();\n";
    }
    out << "}\n\n";
  }
  out << "}  // namespace poise\n";
}

void WriteTable(const std::string& set, const std::vector<Message>& messages,
                const std::vector<std::string>& files, std::ostream& out) {
  out << "// Generated from .lcm files by poise_traits_generator.\n#include \"" << set
      << "/message_traits.hpp\"\n#include \"lcmtypes/field_table.h\"\n\nnamespace poise {\n"
      << "namespace {\n\n";
  for (const Message& m : messages) {
    out << "constexpr FieldInfo " << Identifier(m) << "[] = {\n";
    for (const LcmField& f : m.lcm.fields) {
      const bool literal = f.literal_dimension();
      out << "    {\"" << f.name << "\", \"" << f.type << "\", \"" << (literal ? "" : f.dimension)
          << "\", \"" << UnitOf(f.comment) << "\", " << (literal ? f.dimension : "0") << "},\n";
    }
    out << "};\n";
  }
  out << "constexpr StructInfo kStructs[] = {\n";
  for (const Message& m : messages) {
    out << "    {\"" << m.lcm.name << "\", " << Identifier(m) << "},\n";
  }
  out << "};\nconstexpr const char* kDefinitions[] = {\n";
  for (const std::string& file : files) {
    std::ifstream in(file);
    out << "    R\"lcm(" << in.rdbuf() << ")lcm\",\n";
  }
  out << "};\n\n}  // namespace\n\nMessageSet " << set << "_messages();\n\nMessageSet " << set
      << "_messages() {\n  static const MessageType types[] = {\n";
  for (const Message& m : messages) {
    const std::string type = "::" + Separated(m.lcm.package, "::") + "::" + m.name;
    if (m.has_header) out << "      MessageTypeOf<" << type << ">(),\n";
  }
  out << "  };\n  return {types, kStructs, kDefinitions};\n}\n\n";
  // Linked in as an object, it makes its messages known by itself; Poise's own are in one library.
  if (set != "poise" && set != "operate" && set != "steps" && set != "derived") {
    out << "namespace {\n[[maybe_unused]] const bool known = AddMessages(" << set
        << "_messages());\n}  // namespace\n\n";
  }
  out << "}  // namespace poise\n";
}

/// The structs of `files`, by full name; the types of their fields in full.
std::map<std::string, LcmStruct> Parse(const std::vector<std::string>& files) {
  std::map<std::string, LcmStruct> structs;
  for (const std::string& file : files) {
    LcmStruct lcm = ParseLcmFile(file);
    for (LcmField& field : lcm.fields) {
      if (field.type == "string" || kScalarSizes.contains(field.type)) continue;
      const size_t dot = field.type.rfind('.');
      field.type = dot == std::string::npos
                       ? FullName(lcm.package, field.type)
                       : FullName(field.type.substr(0, dot), field.type.substr(dot + 1));
    }
    lcm.name = FullName(lcm.package, lcm.name);
    structs[lcm.name] = lcm;
  }
  return structs;
}

int Generate(const std::string& set, const std::string& output_dir,
             const std::vector<std::string>& files, const std::vector<std::string>& imports) {
  const std::map<std::string, LcmStruct> own = Parse(files);
  std::map<std::string, LcmStruct> all = Parse(imports);
  for (const auto& [name, lcm] : own) {
    if ((lcm.package == "poise") != (set == "poise")) {
      Fail(lcm, 1,
           set == "poise" ? "package must be poise"
                          : "package poise is Poise's own; choose another");
    }
    if (!all.emplace(name, lcm).second) Fail(lcm, lcm.line, name + " is there twice");
  }
  std::set<std::string> nested;
  for (const auto& [name, lcm] : own) {
    for (const LcmField& field : lcm.fields) {
      if (all.contains(field.type)) nested.insert(field.type);
    }
  }
  std::vector<Message> messages;
  for (const auto& [name, lcm] : own) messages.push_back(Check(lcm, nested, all));
  for (const std::string& name : nested) {
    if (!own.contains(name)) Check(all.at(name), nested, all);
  }

  const std::string dir = output_dir + "/" + set;
  std::filesystem::create_directories(dir);
  std::ofstream traits(dir + "/message_traits.hpp");
  WriteHeader(set, messages, all, traits);
  std::ofstream table(dir + "/message_table.cc");
  WriteTable(set, messages, files, table);
  traits.close();
  table.close();
  if (!traits || !table) throw std::runtime_error(dir + ": cannot be written");
  return 0;
}

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  const auto import = std::find(arguments.begin(), arguments.end(), "--import");
  if (import - arguments.begin() < 3) {
    std::cerr
        << "usage: poise_traits_generator NAME OUTPUT_DIR FILE.lcm ... [--import FILE.lcm ...]\n";
    return 2;
  }
  try {
    return poise::Generate(arguments[0], arguments[1], {arguments.begin() + 2, import},
                           {import == arguments.end() ? import : import + 1, arguments.end()});
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
