#include "components/framework/configuration/added_fields.h"

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "components/framework/configuration/config_error.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace pb = google::protobuf;

constexpr int kFirstNumber = 1000;
constexpr int kTab = 8;  // columns, as the tokenizer counts
constexpr char kPackage[] = "poise.added";

/// The fields are extensions, declared at run time in files of their own.
struct Added {
  pb::DescriptorPool pool{pb::DescriptorPool::generated_pool()};
  std::vector<const pb::FieldDescriptor*> fields;
};

Added& TheAdded() {
  static Added* const added = new Added;  // descriptors outlive everything
  return *added;
}

class Finder final : public pb::TextFormat::Finder {
 public:
  const pb::FieldDescriptor* FindExtension(pb::Message* message,
                                           const std::string& name) const override {
    const pb::FieldDescriptor* const field = FindField(*message->GetDescriptor(), name);
    return field != nullptr && field->is_extension() ? field : nullptr;
  }
};

/// Writes an added field by its plain name.
class PlainNames final : public pb::TextFormat::FastFieldValuePrinter {
 public:
  void PrintFieldName(const pb::Message& message, const pb::Reflection* reflection,
                      const pb::FieldDescriptor* field,
                      pb::TextFormat::BaseTextGenerator* generator) const override {
    if (field->is_extension()) {
      generator->PrintString(field->name());
    } else {
      FastFieldValuePrinter::PrintFieldName(message, reflection, field, generator);
    }
  }
};

class NoErrors final : public pb::io::ErrorCollector {
 public:
  void AddError(int, pb::io::ColumnNumber, const std::string&) override {}
};

}  // namespace

void AddField(const pb::Descriptor& to, const std::string& name, const pb::Descriptor& group) {
  if (const pb::FieldDescriptor* const known = FindField(to, name)) {
    if (known->message_type() == &group && !known->is_repeated()) return;
    throw ConfigError(
        fmt::format("'{}' is a field of {} already; choose another name", name, to.full_name()));
  }
  Added& added = TheAdded();
  pb::FileDescriptorProto file;
  file.set_name(fmt::format("poise/added/{}/{}.proto", to.full_name(), name));
  file.set_package(fmt::format("{}.{}", kPackage, to.name()));
  file.set_syntax("proto2");
  file.add_dependency(to.file()->name());
  if (group.file() != to.file()) file.add_dependency(group.file()->name());
  pb::FieldDescriptorProto* const field = file.add_extension();
  field->set_name(name);
  field->set_number(kFirstNumber + static_cast<int>(added.fields.size()));
  field->set_label(pb::FieldDescriptorProto::LABEL_OPTIONAL);
  field->set_type(pb::FieldDescriptorProto::TYPE_MESSAGE);
  field->set_type_name("." + group.full_name());
  field->set_extendee("." + to.full_name());
  const pb::FileDescriptor* const built = added.pool.BuildFile(file);
  if (built == nullptr) {
    throw ConfigError(
        fmt::format("'{}' cannot be a field of {}: is it a name of small letters, digits and _?",
                    name, to.full_name()));
  }
  added.fields.push_back(built->extension(0));
}

const pb::FieldDescriptor* FindField(const pb::Descriptor& type, std::string_view name) {
  if (const auto* const own = type.FindFieldByName(std::string(name))) return own;
  for (const pb::FieldDescriptor* field : TheAdded().fields) {
    if (field->containing_type() == &type && field->name() == name) return field;
  }
  return nullptr;
}

std::vector<const pb::FieldDescriptor*> AddedFields(const pb::Descriptor& type) {
  std::vector<const pb::FieldDescriptor*> fields;
  for (const pb::FieldDescriptor* field : TheAdded().fields) {
    if (field->containing_type() == &type) fields.push_back(field);
  }
  return fields;
}

std::string TextOf(const pb::Message& message, bool one_line) {
  pb::TextFormat::Printer printer;
  printer.SetSingleLineMode(one_line);
  printer.SetDefaultFieldValuePrinter(new PlainNames);  // taken over
  std::string text;
  printer.PrintToString(message, &text);
  if (one_line && text.ends_with(' ')) text.pop_back();
  return text;
}

std::string WithBrackets(std::string_view text, const pb::Descriptor& type) {
  if (TheAdded().fields.empty()) return std::string(text);
  NoErrors errors;  // the parser finds them, too
  pb::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  pb::io::Tokenizer tokens(&stream, &errors);
  tokens.set_comment_style(pb::io::Tokenizer::SH_COMMENT_STYLE);
  std::string result;
  size_t copied = 0;
  size_t line_start = 0;
  int line = 0;
  std::vector<const pb::Descriptor*> open{&type};  // groups around a token; nullptr: not known
  const pb::Descriptor* named = nullptr;           // type of the last field by name, of a group
  bool in_name = true;                             // a value may be an identifier
  while (tokens.Next()) {
    const auto& token = tokens.current();
    for (; line < token.line; ++line) line_start = text.find('\n', line_start) + 1;
    if (token.text == "{" || token.text == "<") open.push_back(named);
    if ((token.text == "}" || token.text == ">") && open.size() > 1) {
      named = open.back();  // of a list's next element, too
      open.pop_back();
    }
    const bool name = in_name && token.type == pb::io::Tokenizer::TYPE_IDENTIFIER;
    in_name = token.text != ":" && token.text != "[";
    if (!name) continue;
    const auto* const field = open.back() ? FindField(*open.back(), token.text) : nullptr;
    named = field != nullptr ? field->message_type() : nullptr;
    if (field == nullptr || !field->is_extension()) continue;
    size_t at = line_start;
    for (int column = 0; column < token.column; ++at) {
      column = text[at] == '\t' ? (column / kTab + 1) * kTab : column + 1;
    }
    result.append(text.substr(copied, at - copied)).append("[").append(token.text).append("]");
    copied = at + token.text.size();
  }
  return result.append(text.substr(copied));
}

pb::TextFormat::Finder* AddedFieldFinder() {
  static auto* const finder = new Finder;
  return finder;
}

}  // namespace poise
