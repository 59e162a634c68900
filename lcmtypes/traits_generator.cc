// Writes poise/message_traits.hpp, message_table.cc and message_field_table.cc from the .lcm files,
// and refuses messages that the framework could not check before decoding. Usage:
// poise_traits_generator OUTPUT_DIR FILE.lcm ...
#include <algorithm>
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

struct Message {
  LcmStruct lcm;
  std::vector<std::string> counts;
  bool has_header = false;
  bool has_strings = false;
};

[[noreturn]] void Fail(const LcmStruct& lcm, int line, const std::string& problem) {
  throw std::runtime_error(lcm.file + ":" + std::to_string(line) + ": " + problem);
}

/// Splits off the leading counts and checks the rules of the house.
Message Check(const LcmStruct& lcm, const std::set<std::string>& nested,
              const std::map<std::string, LcmStruct>& all) {
  Message message{lcm, {}, false, false};
  if (lcm.package != "poise") Fail(lcm, 1, "package must be poise");
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
  const std::string& name = message.lcm.name;
  const size_t n = message.counts.size();
  out << "template <>\nstruct MessageTraits<" << name << "> {\n"
      << "  static constexpr const char* kName = \"" << name << "\";\n"
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
  for (const std::string unit : {"m/s^2", "rad/s", "m/s", "N·m", "rad", "us", "m", "N", "A", "s"}) {
    if (!comment.starts_with(unit)) continue;
    if (comment.size() == unit.size() ||
        std::string(",;:( ").find(comment[unit.size()]) != std::string::npos) {
      return unit;
    }
  }
  return "";
}

void WriteFieldTable(const std::vector<Message>& messages, std::ostream& out) {
  out << "// Generated from lcmtypes/*.lcm by poise_traits_generator.\n#include "
         "\"lcmtypes/field_table.h\"\n\nnamespace poise {\nnamespace {\n\n";
  for (const Message& m : messages) {
    out << "constexpr FieldInfo k_" << m.lcm.name << "[] = {\n";
    for (const LcmField& f : m.lcm.fields) {
      out << "    {\"" << f.name << "\", \"" << f.type << "\", \""
          << (f.literal_dimension() ? "" : f.dimension) << "\", \"" << UnitOf(f.comment)
          << "\"},\n";
    }
    out << "};\n";
  }
  out << "\n}  // namespace\n\nstd::span<const FieldInfo> FieldsOf(std::string_view type) {\n";
  for (const Message& m : messages) {
    out << "  if (type == \"" << m.lcm.name << "\") return k_" << m.lcm.name << ";\n";
  }
  out << "  return {};\n}\n\n}  // namespace poise\n";
}

int Generate(const std::string& output_dir, const std::vector<std::string>& files) {
  std::map<std::string, LcmStruct> all;
  for (const std::string& file : files) {
    LcmStruct lcm = ParseLcmFile(file);
    all[lcm.name] = lcm;
  }
  std::set<std::string> nested;
  for (auto& [name, lcm] : all) {
    for (LcmField& field : lcm.fields) {
      if (field.type.starts_with("poise.")) field.type.erase(0, 6);
      if (all.contains(field.type)) nested.insert(field.type);
    }
  }
  std::vector<Message> messages;
  for (const auto& [name, lcm] : all) messages.push_back(Check(lcm, nested, all));

  std::ofstream traits(output_dir + "/message_traits.hpp");
  traits << "// Generated from lcmtypes/*.lcm by poise_traits_generator.\n#pragma once\n\n"
         << "#include <array>\n#include <cstdint>\n#include <span>\n\n#include "
            "\"lcmtypes/message_fields.h\"\n";
  for (const Message& m : messages) traits << "#include \"poise/" << m.lcm.name << ".hpp\"\n";
  traits << "\nnamespace poise {\n\n";
  for (const Message& m : messages) WriteTraits(m, all, traits);
  traits << "// Calls f.template operator()<T>() for every message type with a header.\n"
         << "template <class F>\nvoid ForEachMessageType(F&& f) {\n";
  for (const Message& m : messages) {
    if (m.has_header) traits << "  f.template operator()<" << m.lcm.name << ">();\n";
  }
  traits << "}\n\n}  // namespace poise\n";

  std::ofstream table(output_dir + "/message_table.cc");
  table << "// Generated from lcmtypes/*.lcm by poise_traits_generator.\n#include "
           "\"poise/message_traits.hpp\"\n\n"
        << "namespace poise {\nnamespace {\n\ntemplate <class T>\nMessageType TypeOf() {\n"
        << "  using Traits = MessageTraits<T>;\n"
        << "  return {Traits::kName, T::getHash(), Traits::kCountNames, Traits::kHasHeader, "
           "Traits::kHasStrings,\n"
        << "          Traits::kRunIdOffset, &Traits::EncodedSize, &Traits::WellFormedSize, "
           "&message_internal::DecodeAndVisit<T>};\n}\n\n"
        << "}  // namespace\n\nstd::span<const MessageType> MessageTypes() {\n"
        << "  static const MessageType types[] = {\n";
  for (const Message& m : messages) {
    if (m.has_header) table << "      TypeOf<" << m.lcm.name << ">(),\n";
  }
  table << "  };\n  return types;\n}\n\n"
        << "const MessageType* FindMessageType(std::string_view name) {\n"
        << "  for (const MessageType& type : MessageTypes()) {\n    if (name == type.name) return "
           "&type;\n  }\n"
        << "  return nullptr;\n}\n\n"
        << "const MessageType* FindMessageType(int64_t fingerprint) {\n"
        << "  for (const MessageType& type : MessageTypes()) {\n"
        << "    if (fingerprint == type.fingerprint) return &type;\n  }\n  return nullptr;\n}\n\n"
        << "}  // namespace poise\n";
  std::ofstream fields(output_dir + "/message_field_table.cc");
  WriteFieldTable(messages, fields);
  traits.close();
  table.close();
  fields.close();
  if (!traits || !table || !fields) throw std::runtime_error(output_dir + ": cannot be written");
  return 0;
}

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: poise_traits_generator OUTPUT_DIR FILE.lcm ...\n";
    return 2;
  }
  try {
    return poise::Generate(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
