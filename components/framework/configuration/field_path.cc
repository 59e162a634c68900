// Dotted paths into protobuf messages.
#include "components/framework/configuration/field_path.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <vector>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"

namespace poise {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

struct Step {
  std::string name;
  int index = -1;   ///< -1: none given
  std::string key;  ///< in place of an index: the element's own name
};

// What an element of a list is called by, where its type has such a field.
constexpr const char* kNameFields[] = {"name", "metric", "joint", "component", "channel", "link"};

/// nullopt when the path is not NAME, NAME[INDEX] or NAME[ELEMENT], joined by dots.
std::optional<std::vector<Step>> SplitPath(std::string_view path) {
  std::vector<Step> steps;
  while (true) {
    const size_t dot = path.find('.');
    std::string_view part = path.substr(0, dot);
    Step step;
    const size_t bracket = part.find('[');
    if (bracket != std::string_view::npos) {
      std::string_view index = part.substr(bracket + 1);
      if (index.size() < 2 || index.back() != ']') return std::nullopt;
      index.remove_suffix(1);
      const auto [end, error] =
          std::from_chars(index.data(), index.data() + index.size(), step.index);
      if (error == std::errc::result_out_of_range) return std::nullopt;
      if (error != std::errc() || end != index.data() + index.size()) {
        step.index = -1;
        step.key = index;
      } else if (step.index < 0) {
        return std::nullopt;
      }
      if (step.key.find_first_of("[]\"'") != std::string::npos) return std::nullopt;
      part = part.substr(0, bracket);
    }
    if (part.empty()) return std::nullopt;
    step.name = part;
    steps.push_back(step);
    if (dot == std::string_view::npos) return steps;
    path.remove_prefix(dot + 1);
  }
}

std::vector<std::string> FieldNames(const Descriptor& type) {
  std::vector<std::string> names;
  for (int i = 0; i < type.field_count(); ++i) names.push_back(type.field(i)->name());
  for (const FieldDescriptor* field : AddedFields(type)) names.push_back(field->name());
  return names;
}

std::string TypeName(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_ENUM: {
      std::vector<std::string> values;
      for (int i = 0; i < field.enum_type()->value_count(); ++i) {
        values.push_back(field.enum_type()->value(i)->name());
      }
      return fmt::format("one of {}", fmt::join(values, ", "));
    }
    case FieldDescriptor::CPPTYPE_BOOL:
      return "true or false";
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return "a number";
    case FieldDescriptor::CPPTYPE_STRING:
      return "text";
    default:
      return fmt::format("a whole number ({})", field.cpp_type_name());
  }
}

template <class Number>
std::optional<Number> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

const FieldDescriptor* NameField(const Descriptor& type) {
  for (const char* name : kNameFields) {
    const FieldDescriptor* const field = type.FindFieldByName(name);
    const bool text = field != nullptr && !field->is_repeated() &&
                      field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
    if (text) return field;
  }
  return nullptr;
}

/// Index of the element of `list` that is called `key`. Throws ConfigError with `path` and the
/// names that there are.
int FindElement(const Message& message, const FieldDescriptor& list, const std::string& key,
                std::string_view path) {
  const FieldDescriptor* const name_field =
      list.message_type() == nullptr ? nullptr : NameField(*list.message_type());
  if (name_field == nullptr) {
    throw ConfigError(path, fmt::format("elements of {} have no names; write an index, {}[0]",
                                        list.name(), list.name()));
  }
  const Reflection& reflection = *message.GetReflection();
  std::vector<std::string> names;
  std::vector<std::string> found;
  int index = -1;
  for (int i = 0; i < reflection.FieldSize(message, &list); ++i) {
    const Message& element = reflection.GetRepeatedMessage(message, &list, i);
    names.push_back(element.GetReflection()->GetString(element, name_field));
    if (names.back() != key) continue;
    if (index < 0) index = i;
    found.push_back(fmt::format("{}[{}]", list.name(), i));
  }
  if (found.size() > 1) {
    throw ConfigError(path, fmt::format("{} elements are called '{}'; write one of {}",
                                        found.size(), key, fmt::join(found, ", ")));
  }
  if (index < 0) {
    throw ConfigError(
        path, names.empty()
                  ? fmt::format("{} is empty; {}[0] adds an element", list.name(), list.name())
                  : fmt::format("no {} is called '{}'; {}", list.name(), key, Suggest(key, names)));
  }
  return index;
}

/// "push[0].peak, or push[1].peak to add one": what `path` may mean, whose step `at` names the list
/// `field` without saying which element.
std::string WhichElement(const Message& message, const FieldDescriptor& field,
                         const std::vector<Step>& steps, size_t at) {
  const auto written = [&](const std::string& element) {
    std::string path;
    for (size_t i = 0; i < steps.size(); ++i) {
      if (i > 0) path += '.';
      path += steps[i].name;
      if (i == at) {
        path += fmt::format("[{}]", element);
      } else if (!steps[i].key.empty()) {
        path += fmt::format("[{}]", steps[i].key);
      } else if (steps[i].index >= 0) {
        path += fmt::format("[{}]", steps[i].index);
      }
    }
    return path;
  };
  const int size = message.GetReflection()->FieldSize(message, &field);
  if (size == 0) return fmt::format("is an empty list; {} adds an element", written("0"));
  const bool named = field.message_type() != nullptr && NameField(*field.message_type()) != nullptr;
  const std::string last =
      size == 1 ? "" : fmt::format(" to {}", written(std::to_string(size - 1)));
  return fmt::format("is a list of {}; write {}{}{}; {} adds an element", size, written("0"), last,
                     named ? ", or the element's name for its number" : "",
                     written(std::to_string(size)));
}

/// Sets a scalar; index -1 for a field that is not repeated, the field's size for one element more.
/// False when `text` is no value of its type, and nothing has changed then.
bool SetScalar(Message* message, const FieldDescriptor* field, int index, std::string_view text) {
  const Reflection* r = message->GetReflection();
  const auto set = [&](auto value, auto single, auto repeated, auto add) {
    if (!value.has_value()) return false;
    if (index < 0) {
      (r->*single)(message, field, *value);
    } else if (index == r->FieldSize(*message, field)) {
      (r->*add)(message, field, *value);
    } else {
      (r->*repeated)(message, field, index, *value);
    }
    return true;
  };
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return set(ParseNumber<double>(text), &Reflection::SetDouble, &Reflection::SetRepeatedDouble,
                 &Reflection::AddDouble);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return set(ParseNumber<float>(text), &Reflection::SetFloat, &Reflection::SetRepeatedFloat,
                 &Reflection::AddFloat);
    case FieldDescriptor::CPPTYPE_INT32:
      return set(ParseNumber<int32_t>(text), &Reflection::SetInt32, &Reflection::SetRepeatedInt32,
                 &Reflection::AddInt32);
    case FieldDescriptor::CPPTYPE_INT64:
      return set(ParseNumber<int64_t>(text), &Reflection::SetInt64, &Reflection::SetRepeatedInt64,
                 &Reflection::AddInt64);
    case FieldDescriptor::CPPTYPE_UINT32:
      return set(ParseNumber<uint32_t>(text), &Reflection::SetUInt32,
                 &Reflection::SetRepeatedUInt32, &Reflection::AddUInt32);
    case FieldDescriptor::CPPTYPE_UINT64:
      return set(ParseNumber<uint64_t>(text), &Reflection::SetUInt64,
                 &Reflection::SetRepeatedUInt64, &Reflection::AddUInt64);
    case FieldDescriptor::CPPTYPE_BOOL: {
      std::optional<bool> value;
      if (text == "true" || text == "1") value = true;
      if (text == "false" || text == "0") value = false;
      return set(value, &Reflection::SetBool, &Reflection::SetRepeatedBool, &Reflection::AddBool);
    }
    case FieldDescriptor::CPPTYPE_ENUM: {
      const auto* value = field->enum_type()->FindValueByName(std::string(text));
      return set(value != nullptr ? std::optional(value) : std::nullopt, &Reflection::SetEnum,
                 &Reflection::SetRepeatedEnum, &Reflection::AddEnum);
    }
    case FieldDescriptor::CPPTYPE_STRING:
      return set(std::optional(std::string(text)), &Reflection::SetString,
                 &Reflection::SetRepeatedString, &Reflection::AddString);
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return false;
  }
  return false;
}

/// A field and the message that has it, or may have it.
struct FoundField {
  const Message* owner = nullptr;
  const FieldDescriptor* field = nullptr;  ///< nullptr: there is no such field or element
  int index = -1;                          ///< of a list's element; -1: the whole field
  bool plain = true;  ///< every group on the way is set, and none is a list's element
};

FoundField Find(const Message& message, std::string_view path) {
  FoundField found{&message};
  for (const Step& step : SplitPath(path).value_or(std::vector<Step>())) {
    if (found.field != nullptr) {  // the group that the step is in
      if (found.field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) return {};
      const Reflection& reflection = *found.owner->GetReflection();
      const bool list = found.field->is_repeated();
      const int index = std::max(found.index, 0);
      if (list && index >= reflection.FieldSize(*found.owner, found.field)) return {};
      found.plain = found.plain && !list && reflection.HasField(*found.owner, found.field);
      found.owner = list ? &reflection.GetRepeatedMessage(*found.owner, found.field, index)
                         : &reflection.GetMessage(*found.owner, found.field);
    }
    found.field = FindField(*found.owner->GetDescriptor(), step.name);
    if (found.field == nullptr || !step.key.empty()) return {};
    found.index = found.field->is_repeated() ? step.index : -1;
  }
  return found;
}

/// Text format's errors are of no interest where the text was parsed before.
class IgnoreErrors final : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, google::protobuf::io::ColumnNumber, const std::string&) override {}
};

}  // namespace

int LocateField(std::string_view text, std::string_view field, const Message& prototype) {
  const auto steps = SplitPath(field);
  if (!steps.has_value()) return 0;
  using google::protobuf::TextFormat;
  TextFormat::ParseInfoTree tree;
  TextFormat::Parser parser;
  IgnoreErrors errors;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&tree);
  parser.AllowPartialMessage(true);
  const std::unique_ptr<Message> message(prototype.New());
  parser.SetFinder(AddedFieldFinder());
  parser.ParseFromString(WithBrackets(text, *prototype.GetDescriptor()), message.get());

  const TextFormat::ParseInfoTree* level = &tree;
  const Descriptor* type = prototype.GetDescriptor();
  int line = 0;
  for (const Step& step : *steps) {
    const FieldDescriptor* descriptor = FindField(*type, step.name);
    if (descriptor == nullptr) break;
    // Without an index a repeated field means its first element.
    const int index = descriptor->is_repeated() ? std::max(step.index, 0) : -1;
    const auto location = level->GetLocation(descriptor, index);
    if (location.line < 0) break;
    line = location.line + 1;
    if (descriptor->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) break;
    level = level->GetTreeForNested(descriptor, index);
    if (level == nullptr) break;
    type = descriptor->message_type();
  }
  return line;
}

std::string ResolvePath(const Message& message, std::string_view path) {
  const auto steps = SplitPath(path);
  if (!steps.has_value()) return std::string(path);
  std::string resolved;
  for (const Step& step : *steps) {
    resolved += (resolved.empty() ? "" : ".") + step.name;
    int index = step.index;
    const FoundField list = step.key.empty() ? FoundField() : Find(message, resolved);
    if (list.field != nullptr && list.field->is_repeated()) {
      index = FindElement(*list.owner, *list.field, step.key, path);
    }
    if (index >= 0) resolved += fmt::format("[{}]", index);
  }
  return resolved;
}

int CountField(const Message& message, std::string_view path) {
  const auto [owner, field, index, plain] = Find(message, path);
  if (field == nullptr) return 0;
  const Reflection& reflection = *owner->GetReflection();
  if (!field->is_repeated()) return reflection.HasField(*owner, field) ? 1 : 0;
  const int size = reflection.FieldSize(*owner, field);
  return index < 0 ? size : index < size ? 1 : 0;
}

bool HasField(const Message& message, std::string_view path) {
  return CountField(message, path) > 0;
}

std::string ValueText(const Message& message, std::string_view path) {
  const auto [owner, field, index, plain] = Find(message, path);
  std::string text;
  if (!HasField(message, path) || field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    return text;
  }
  google::protobuf::TextFormat::PrintFieldValueToString(
      *owner, field, field->is_repeated() ? std::max(index, 0) : -1, &text);
  return text;
}

bool IsTrue(const Message& message, std::string_view path) {
  const auto [owner, field, index, plain] = Find(message, path);
  if (field == nullptr || field->is_repeated() || !plain) return false;
  const Reflection& reflection = *owner->GetReflection();
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return reflection.GetBool(*owner, field);
  return field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
         reflection.HasField(*owner, field);
}

bool ClearField(Message* message, std::string_view path) {
  const auto [owner, field, index, plain] = Find(*message, path);
  const bool indexed = path.find('[') != std::string_view::npos;
  if (indexed || !plain || CountField(*message, path) == 0) return false;
  // Whoever may change the message may change what it holds.
  auto* const group = const_cast<Message*>(owner);
  group->GetReflection()->ClearField(group, field);
  return true;
}

Message* MutableGroup(Message* message, std::string_view path) {
  Message* group = message;
  for (size_t begin = 0; begin <= path.size();) {
    const size_t end = std::min(path.find('.', begin), path.size());
    const auto* const field = FindField(*group->GetDescriptor(), path.substr(begin, end - begin));
    group = group->GetReflection()->MutableMessage(group, field);
    begin = end + 1;
  }
  return group;
}

void SetField(Message* message, std::string_view path, std::string_view value) {
  const auto steps = SplitPath(path);
  const auto fail = [&](const std::string& problem) { throw ConfigError(path, problem); };
  if (!steps.has_value()) fail("not a path; write name.name[index].name=value");
  std::string walked;
  Message* level = message;
  for (size_t i = 0; i < steps->size(); ++i) {
    const Step& step = (*steps)[i];
    const bool last = i + 1 == steps->size();
    const Descriptor& type = *level->GetDescriptor();
    const FieldDescriptor* field = FindField(type, step.name);
    if (field == nullptr) {
      fail(fmt::format("{} has no field '{}'; {}", walked.empty() ? type.name() : walked, step.name,
                       Suggest(step.name, FieldNames(type))));
    }
    walked += (walked.empty() ? "" : ".") + step.name;
    const Reflection* reflection = level->GetReflection();
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    const bool text = field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
    const bool whole = step.index < 0 && step.key.empty();
    if (last && value.empty() && whole &&
        (field->is_repeated() || is_message || (!text && !field->has_default_value()))) {
      reflection->ClearField(level, field);
      return;
    }
    int index = -1;
    if (field->is_repeated()) {
      const int size = reflection->FieldSize(*level, field);
      if (whole) fail(fmt::format("{} {}", walked, WhichElement(*level, *field, *steps, i)));
      index = step.key.empty() ? step.index : FindElement(*level, *field, step.key, path);
      if (index > size) {
        fail(fmt::format("{} has {} element{}; the index may be 0 to {}", walked, size,
                         size == 1 ? "" : "s", size));
      }
      walked.append("[").append(std::to_string(index)).append("]");
    } else if (!whole) {
      fail(fmt::format("{} is not a list; leave out the index", walked));
    }
    if (last == is_message) {
      fail(last ? fmt::format("{} is a group of fields; name one of them: {}", walked,
                              fmt::join(FieldNames(*field->message_type()), ", "))
                : fmt::format("{} is {}, not a group of fields", walked, TypeName(*field)));
    }
    if (last) {
      if (!SetScalar(level, field, index, value)) {
        fail(fmt::format("'{}' is not {}", value, TypeName(*field)));
      }
      return;
    }
    if (index < 0) {
      level = reflection->MutableMessage(level, field);
    } else if (index == reflection->FieldSize(*level, field)) {
      level = reflection->AddMessage(level, field);
    } else {
      level = reflection->MutableRepeatedMessage(level, field, index);
    }
  }
}

}  // namespace poise
