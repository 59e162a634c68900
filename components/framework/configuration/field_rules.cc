#include "components/framework/configuration/field_rules.h"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <charconv>
#include <cmath>
#include <vector>

#include "components/framework/configuration/config_error.h"
#include "components/framework/configuration/rule.pb.h"

namespace poise {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

bool Allows(const FieldRule& rule, double value) {
  return std::isfinite(value) && !(rule.has_min() && value < rule.min()) &&
         !(rule.has_max() && value > rule.max()) && !(rule.has_above() && value <= rule.above()) &&
         !(rule.has_below() && value >= rule.below());
}

std::string Range(const FieldRule& rule) {
  if (rule.has_min() && rule.has_max()) return fmt::format("{} to {}", rule.min(), rule.max());
  if (rule.has_min() && !rule.has_below()) return fmt::format("{} or more", rule.min());
  if (rule.has_max() && !rule.has_above()) return fmt::format("at most {}", rule.max());
  std::string low;
  if (rule.has_min()) low = fmt::format("at least {}", rule.min());
  if (rule.has_above()) low = fmt::format("greater than {}", rule.above());
  std::string high;
  if (rule.has_max()) high = fmt::format("at most {}", rule.max());
  if (rule.has_below()) high = fmt::format("less than {}", rule.below());
  return low + (low.empty() || high.empty() ? "" : " and ") + high;
}

const FieldRule& RuleOf(const FieldDescriptor& field) { return field.options().GetExtension(rule); }

/// `text`: the value as it is written.
void Check(const FieldDescriptor& field, double value, const std::string& text,
           const std::string& path) {
  if (Allows(RuleOf(field), value)) return;
  std::string range = RangeOf(field);
  if (!std::isfinite(value)) range = range.empty() ? "finite" : "finite and " + range;
  throw ConfigError(path, fmt::format("is {}; must be {}", text, range));
}

/// Checks the element `i` of a list, or a single value where `i` is −1.
void CheckValue(const Message& message, const FieldDescriptor& field, int i,
                const std::string& path) {
  const Reflection& values = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return CheckFields(i < 0 ? values.GetMessage(message, &field)
                               : values.GetRepeatedMessage(message, &field, i),
                         path + ".");
    case FieldDescriptor::CPPTYPE_BOOL:
    case FieldDescriptor::CPPTYPE_ENUM:
    case FieldDescriptor::CPPTYPE_STRING:
      return;
    default: {
      std::string text;
      google::protobuf::TextFormat::PrintFieldValueToString(message, &field, i, &text);
      double value = 0;
      std::from_chars(text.data(), text.data() + text.size(), value);
      return Check(field, value, text, path);
    }
  }
}

}  // namespace

void CheckFields(const Message& config, const std::string& prefix) {
  std::vector<const FieldDescriptor*> fields;
  config.GetReflection()->ListFields(config, &fields);
  for (const FieldDescriptor* field : fields) {
    const std::string path = prefix + field->name();
    if (!field->is_repeated()) {
      CheckValue(config, *field, -1, path);
      continue;
    }
    for (int i = 0; i < config.GetReflection()->FieldSize(config, field); ++i) {
      CheckValue(config, *field, i, fmt::format("{}[{}]", path, i));
    }
  }
}

void RequireFields(const Message& config, std::initializer_list<const char*> names,
                   const std::string& prefix) {
  for (const char* name : names) {
    const FieldDescriptor& field = *config.GetDescriptor()->FindFieldByName(name);
    if (config.GetReflection()->HasField(config, &field)) continue;
    const std::string range = RangeOf(field);
    throw ConfigError(prefix + name, fmt::format("is missing; must be {}",
                                                 range.empty() ? "a finite number" : range));
  }
}

std::string RangeOf(const FieldDescriptor& field) { return Range(RuleOf(field)); }

}  // namespace poise
