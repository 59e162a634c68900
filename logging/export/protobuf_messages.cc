#include "logging/export/protobuf_messages.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <variant>
#include <vector>

#include "fmt/format.h"
#include "lcmtypes/field_table.h"
#include "logging/printable.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

namespace pb = google::protobuf;

bool IsArray(const FieldInfo& field) { return *field.count != '\0' || field.length > 0; }

/// The message of a struct: a package other than poise is a part of its name.
std::string MessageName(std::string_view type) {
  std::string name(type);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

/// A name that Protobuf takes, of those in `taken` none.
std::string FieldName(const std::string& name, std::set<std::string>* taken) {
  std::string plain = name;
  std::replace_if(
      plain.begin(), plain.end(),
      [](unsigned char c) { return c > 0x7f || (!std::isalnum(c) && c != '_'); }, '_');
  if (std::isdigit(static_cast<unsigned char>(plain.front()))) plain.insert(0, "_");
  std::string unique = plain;
  for (int i = 2; !taken->insert(unique).second; ++i) unique = plain + "_" + std::to_string(i);
  return unique;
}

/// Makes the file of all types.
class SchemaBuilder {
 public:
  SchemaBuilder(const ElementNames& names, pb::FileDescriptorProto* file)
      : names_(names), file_(file) {}

  void AddStruct(const std::string& type) {
    if (Has(MessageName(type))) return;
    pb::DescriptorProto message;
    message.set_name(MessageName(type));
    for (const FieldInfo& field : FieldsOf(type)) AddField(type, field, &message);
    *file_->add_message_type() = std::move(message);
  }

 private:
  bool Has(const std::string& name) const {
    const auto& types = file_->message_type();
    return std::ranges::find(types, name, &pb::DescriptorProto::name) != types.end();
  }

  void SetType(const std::string& type, pb::FieldDescriptorProto* field) {
    using Field = pb::FieldDescriptorProto;
    static const std::map<std::string_view, Field::Type> scalars = {
        {"int8_t", Field::TYPE_INT32},  {"byte", Field::TYPE_INT32},
        {"boolean", Field::TYPE_INT32}, {"int16_t", Field::TYPE_INT32},
        {"int32_t", Field::TYPE_INT32}, {"int64_t", Field::TYPE_INT64},
        {"float", Field::TYPE_FLOAT},   {"double", Field::TYPE_DOUBLE},
        {"string", Field::TYPE_STRING}};
    if (const auto scalar = scalars.find(type); scalar != scalars.end()) {
      field->set_type(scalar->second);
    } else {
      AddStruct(type);
      field->set_type(Field::TYPE_MESSAGE);
      field->set_type_name("." + ProtobufMessages::FullName(type));
    }
  }

  /// Adds the message of an array's named elements; returns its name, "joints_double".
  std::string AddElements(const FieldInfo& info, const std::vector<std::string>& names) {
    constexpr std::string_view kCount = "num_";
    pb::DescriptorProto message;
    message.set_name(fmt::format("{}_{}", std::string_view(info.count).substr(kCount.size()),
                                 MessageName(info.type)));
    if (Has(message.name())) return message.name();
    std::set<std::string> taken;
    for (const std::string& name : names) {
      pb::FieldDescriptorProto* const field = message.add_field();
      field->set_name(FieldName(name, &taken));
      field->set_number(message.field_size());
      field->set_label(pb::FieldDescriptorProto::LABEL_OPTIONAL);
      SetType(info.type, field);
    }
    *file_->add_message_type() = message;
    return message.name();
  }

  void AddField(const std::string& type, const FieldInfo& info, pb::DescriptorProto* message) {
    using Field = pb::FieldDescriptorProto;
    Field* const field = message->add_field();
    field->set_name(info.name);
    field->set_number(message->field_size());
    const std::vector<std::string>& names = names_.Of(type, info.name);
    if (!names.empty()) {
      field->set_label(Field::LABEL_OPTIONAL);
      field->set_type(Field::TYPE_MESSAGE);
      field->set_type_name("." + ProtobufMessages::FullName(AddElements(info, names)));
      return;
    }
    field->set_label(IsArray(info) ? Field::LABEL_REPEATED : Field::LABEL_OPTIONAL);
    SetType(info.type, field);
    const bool number = field->type() != Field::TYPE_MESSAGE && field->type() != Field::TYPE_STRING;
    if (IsArray(info) && number) field->mutable_options()->set_packed(true);
  }

  const ElementNames& names_;
  pb::FileDescriptorProto* file_;
};

/// The scalars of a message, in the order of declaration.
class Scalars final : public ScalarVisitor {
 public:
  using Value = std::variant<int64_t, double, std::string>;

  void Integer(std::string_view, int64_t value) override { values_.emplace_back(value); }
  void Real(std::string_view, double value) override { values_.emplace_back(value); }
  void Text(std::string_view, std::string_view value) override {
    values_.emplace_back(std::string(value));
  }

  /// Precondition: there is one more, as of the message's own fields there is.
  const Value& Next() { return values_.at(next_++); }

 private:
  std::vector<Value> values_;
  size_t next_ = 0;
};

/// Fills a message from its scalars. False: an array has other than the named elements.
class Filler {
 public:
  explicit Filler(Scalars* from) : from_(from) {}

  bool Fill(std::string_view type, pb::Message* to) {
    bool good = true;
    int index = 0;
    for (const FieldInfo& info : FieldsOf(type)) {
      const pb::FieldDescriptor* const field = to->GetDescriptor()->field(index++);
      good = PutField(info, field, to) && good;
    }
    return good;
  }

 private:
  bool PutField(const FieldInfo& info, const pb::FieldDescriptor* field, pb::Message* to) {
    if (!IsArray(info)) return Put(info, field, to);
    const int64_t length = *info.count != '\0' ? counts_[info.count] : info.length;
    bool good = true;
    if (field->is_repeated()) {
      for (int64_t i = 0; i < length; ++i) good = Put(info, field, to) && good;
      return good;
    }
    pb::Message* const elements = to->GetReflection()->MutableMessage(to, field);
    if (elements->GetDescriptor()->field_count() != length) return false;
    for (int i = 0; i < static_cast<int>(length); ++i) {
      good = Put(info, elements->GetDescriptor()->field(i), elements) && good;
    }
    return good;
  }

  /// Sets a field, or appends to it, with one value.
  bool Put(const FieldInfo& info, const pb::FieldDescriptor* field, pb::Message* to) {
    const pb::Reflection& reflection = *to->GetReflection();
    const bool add = field->is_repeated();
    if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      return Fill(info.type,
                  add ? reflection.AddMessage(to, field) : reflection.MutableMessage(to, field));
    }
    const Scalars::Value& value = from_->Next();
    switch (field->cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32: {
        const auto number = static_cast<int32_t>(std::get<int64_t>(value));
        counts_[info.name] = number;
        add ? reflection.AddInt32(to, field, number) : reflection.SetInt32(to, field, number);
        break;
      }
      case pb::FieldDescriptor::CPPTYPE_INT64: {
        const int64_t number = std::get<int64_t>(value);
        add ? reflection.AddInt64(to, field, number) : reflection.SetInt64(to, field, number);
        break;
      }
      case pb::FieldDescriptor::CPPTYPE_DOUBLE: {
        const double number = std::get<double>(value);
        add ? reflection.AddDouble(to, field, number) : reflection.SetDouble(to, field, number);
        break;
      }
      case pb::FieldDescriptor::CPPTYPE_FLOAT: {
        const auto number = static_cast<float>(std::get<double>(value));
        add ? reflection.AddFloat(to, field, number) : reflection.SetFloat(to, field, number);
        break;
      }
      default: {
        const std::string& raw = std::get<std::string>(value);
        const std::string text = IsUtf8(raw) ? raw : LinesForTerminal(raw);  // as Protobuf's are
        add ? reflection.AddString(to, field, text) : reflection.SetString(to, field, text);
      }
    }
    return true;
  }

  Scalars* from_;
  std::map<std::string_view, int64_t> counts_;  // of the message: its leading fields
};

}  // namespace

std::string ProtobufMessages::FullName(std::string_view type) {
  return "poise." + MessageName(type);
}

ProtobufMessages::ProtobufMessages(const ElementNames& names) : factory_(&pool_) {
  pb::FileDescriptorSet set;
  pb::FileDescriptorProto* const file = set.add_file();
  file->set_name("poise/messages.proto");
  file->set_package("poise");
  file->set_syntax("proto2");
  SchemaBuilder builder(names, file);
  for (const MessageType& type : MessageTypes()) builder.AddStruct(type.name);
  if (pool_.BuildFile(*file) == nullptr) {
    throw std::logic_error("the message types make no Protobuf file");
  }
  set.SerializeToString(&file_descriptor_set_);
}

std::optional<std::string> ProtobufMessages::Convert(std::string_view type,
                                                     std::span<const uint8_t> data) {
  const MessageType* const known = FindMessageType(type);
  Scalars scalars;
  if (known == nullptr || !known->visit(data.data(), static_cast<int64_t>(data.size()), &scalars)) {
    return {};
  }
  const pb::Descriptor* const descriptor = pool_.FindMessageTypeByName(FullName(type));
  const std::unique_ptr<pb::Message> converted(factory_.GetPrototype(descriptor)->New());
  if (!Filler(&scalars).Fill(type, converted.get())) return {};
  return converted->SerializeAsString();
}

}  // namespace poise::logging
