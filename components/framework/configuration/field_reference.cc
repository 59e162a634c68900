#include "components/framework/configuration/field_reference.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "components/framework/configuration/config_error.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"

namespace poise {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::SourceLocation;

google::protobuf::DescriptorPool& Schemas() {
  static auto* const pool = new google::protobuf::DescriptorPool;
  return *pool;
}

const Descriptor& TypeNamed(const std::string& type) {
  const Descriptor* const found = Schemas().FindMessageTypeByName(type);
  if (found == nullptr) throw std::logic_error("no schema has the type " + type);
  return *found;
}

/// Words with one space between them.
std::string OneLine(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool space = c == ' ' || c == '\n' || c == '\t';
    if (!space) {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  while (line.ends_with(' ')) line.pop_back();
  return line;
}

/// The comment behind an element, then the one before it.
template <class Element>
std::string Comment(const Element& element) {
  SourceLocation location;
  if (!element.GetSourceLocation(&location)) return {};
  std::string behind = OneLine(location.trailing_comments);
  const std::string before = OneLine(location.leading_comments);
  if (behind.empty()) return before;
  if (before.empty()) return behind;
  if (!behind.ends_with('.')) behind += '.';
  return behind + " " + before;
}

std::string TypeOf(const FieldDescriptor& field) {
  const bool list = field.is_repeated();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return list ? "list of groups" : "group";
    case FieldDescriptor::CPPTYPE_ENUM:
      return list ? "list of names" : "name";
    case FieldDescriptor::CPPTYPE_BOOL:
      return list ? "list of true or false" : "true or false";
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return list ? "list of numbers" : "number";
    case FieldDescriptor::CPPTYPE_STRING:
      return list ? "list of text" : "text";
    default:
      return list ? "list of whole numbers" : "whole number";
  }
}

std::string DefaultOf(const FieldDescriptor& field) {
  if (!field.has_default_value()) return {};
  google::protobuf::FieldDescriptorProto proto;
  field.CopyTo(&proto);
  const bool text = field.cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  return text ? fmt::format("\"{}\"", proto.default_value()) : proto.default_value();
}

void Append(const Descriptor& type, const std::string& prefix, std::vector<FieldEntry>* entries) {
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    if (field.full_name() == "poise.Scenario.applied") continue;
    FieldEntry entry;
    entry.path = prefix + field.name() + (field.is_repeated() ? "[i]" : "");
    entry.type = TypeOf(field);
    entry.default_value = DefaultOf(field);
    entry.group = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    std::string comment = Comment(field);
    if (entry.group) {
      const std::string of_type = Comment(*field.message_type());
      if (!comment.empty() && !of_type.empty()) {
        comment += comment.ends_with('.') ? " " : ". ";
      }
      comment += of_type;
    }
    entry.unit = UnitOf(comment);
    entry.range = RangeOf(field);
    entry.meaning = comment;
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
      const auto& values = *field.enum_type();
      if (entry.meaning.empty()) entry.meaning = Comment(values);
      for (int v = 0; v < values.value_count(); ++v) {
        entry.values.emplace_back(values.value(v)->name(), Comment(*values.value(v)));
      }
    }
    const std::string path = entry.path;
    entries->push_back(std::move(entry));
    if (entries->back().group) Append(*field.message_type(), path + ".", entries);
  }
}

/// "sim.push[0]" as "sim.push[i]", without a dot at its end.
std::string Normalized(std::string_view path) {
  std::string result;
  for (size_t i = 0; i < path.size(); ++i) {
    result += path[i];
    if (path[i] != '[') continue;
    const size_t end = path.find(']', i);
    if (end == std::string_view::npos) continue;
    result += "i]";
    i = end;
  }
  while (result.ends_with('.')) result.pop_back();
  return result;
}

std::string LastName(const std::string& path) { return path.substr(path.rfind('.') + 1); }

}  // namespace

std::string UnitOf(std::string_view comment) {
  // Longer ones first where one begins another.
  static constexpr std::array<std::string_view, 47> kUnits = {
      "rad/s/√s", "m/s^2/√s",  "N·m·s/rad", "N·m/rad", "N·m/A",   "N·m/s",  "N·s/m",   "m/(N·s)",
      "N·m",      "N·s",       "N/m",       "kg·m^2",  "kg",      "m/√s",   "rad/√s",  "m/s^2",
      "m/s",      "rad/s",     "rad",       "1/s^2",   "1/s",     "Hz",     "mN·m",    "mA",
      "ms",       "us",        "ns",        "bits",    "ppm",     "N",      "A",       "s",
      "m",        "per mille", "ticks",     "cycles",  "frames",  "counts", "degrees", "%",
      "runs",     "turns",     "bytes",     "W",       "rad/s^2", "°C",     "V"};
  for (const std::string_view unit : kUnits) {
    if (!comment.starts_with(unit)) continue;
    const std::string_view rest = comment.substr(unit.size());
    // "A" is a word, too, and "s" begins many.
    const bool ends = rest.empty() || rest[0] == ',' || rest[0] == ';' || rest[0] == ':' ||
                      rest[0] == '.' || (rest[0] == ' ' && unit != "A");
    if (ends) return std::string(unit);
  }
  return "";
}

void AddSchema(std::string_view descriptor_set) {
  google::protobuf::FileDescriptorSet files;
  bool good = files.ParseFromArray(descriptor_set.data(), static_cast<int>(descriptor_set.size()));
  for (const auto& file : files.file()) {
    if (Schemas().FindFileByName(file.name()) != nullptr) continue;
    good = good && Schemas().BuildFile(file) != nullptr;
  }
  if (!good) throw std::logic_error("a schema cannot be read");
}

std::vector<FieldEntry> FieldsOfType(const std::string& type, const std::string& prefix) {
  std::vector<FieldEntry> entries;
  Append(TypeNamed(type), prefix, &entries);
  return entries;
}

std::vector<FieldEntry> FieldsOfGroup(const std::string& type, const std::string& path) {
  FieldEntry group;
  group.path = path;
  group.type = "group";
  group.meaning = Comment(TypeNamed(type));
  group.group = true;
  std::vector<FieldEntry> entries = {group};
  Append(TypeNamed(type), path + ".", &entries);
  return entries;
}

std::vector<FieldEntry> SelectFields(const std::vector<FieldEntry>& fields,
                                     std::string_view beginning) {
  const std::string wanted = Normalized(beginning);
  const bool is_path = wanted.find('.') != std::string::npos;
  std::vector<FieldEntry> found;
  const auto select = [&](auto fits) {
    std::copy_if(fields.begin(), fields.end(), std::back_inserter(found), fits);
    return !found.empty();
  };
  if (select([&](const FieldEntry& field) {
        if (wanted.empty()) return true;
        if (!field.path.starts_with(wanted)) return false;
        const std::string_view rest = std::string_view(field.path).substr(wanted.size());
        return rest.empty() || rest[0] == '.' || rest[0] == '[';
      }) ||
      select([&](const FieldEntry& field) {
        if (is_path) return field.path.starts_with(wanted);
        return LastName(field.path).find(wanted) != std::string::npos;
      })) {
    return found;
  }
  std::vector<std::string> names;
  for (const FieldEntry& field : fields) {
    std::string name = is_path ? field.path : LastName(field.path);
    for (size_t at; (at = name.find("[i]")) != name.npos;) name.erase(at, 3);
    names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::string advice = Suggest(wanted, std::move(names));
  if (!advice.starts_with("did you mean")) advice = "`poise list fields` shows all";
  throw ConfigError(fmt::format("there is no field '{}'; {}", beginning, advice));
}

}  // namespace poise
