#include "logging/export/protobuf_messages.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <type_traits>

#include "fmt/format.h"
#include "lcmtypes/field_table.h"
#include "logging/printable.h"
#include "poise/message_traits.hpp"

namespace poise::logging {
namespace {

namespace pb = google::protobuf;

/// Element type of an array or a vector; else the type itself.
template <class F>
struct Element {
  using Type = F;
  static constexpr bool kRepeated = false;
};
template <class E>
struct Element<std::vector<E>> {
  using Type = E;
  static constexpr bool kRepeated = true;
};
template <class E, size_t N>
struct Element<E[N]> {
  using Type = E;
  static constexpr bool kRepeated = true;
};

/// Makes the file of all types.
class SchemaBuilder {
 public:
  SchemaBuilder(const ElementNames& names, pb::FileDescriptorProto* file)
      : names_(names), file_(file) {}

  template <class T>
  void AddMessageType();

 private:
  bool Has(const std::string& type) const;
  template <class E>
  void SetType(pb::FieldDescriptorProto* field);
  template <class F>
  void AddField(const char* name, pb::DescriptorProto* message);
  /// Adds the message of an array's named elements; returns its name, "joints_double".
  template <class E>
  std::string AddElements(const FieldInfo& info, const std::vector<std::string>& names);

  const ElementNames& names_;
  pb::FileDescriptorProto* file_;
};

bool SchemaBuilder::Has(const std::string& type) const {
  const auto& types = file_->message_type();
  return std::any_of(types.begin(), types.end(),
                     [&](const pb::DescriptorProto& other) { return other.name() == type; });
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

template <class E>
void SchemaBuilder::SetType(pb::FieldDescriptorProto* field) {
  using Field = pb::FieldDescriptorProto;
  if constexpr (std::is_integral_v<E>) {
    field->set_type(sizeof(E) <= 4 ? Field::TYPE_INT32 : Field::TYPE_INT64);
  } else if constexpr (std::is_same_v<E, double>) {
    field->set_type(Field::TYPE_DOUBLE);
  } else if constexpr (std::is_same_v<E, float>) {
    field->set_type(Field::TYPE_FLOAT);
  } else if constexpr (std::is_same_v<E, std::string>) {
    field->set_type(Field::TYPE_STRING);
  } else {
    AddMessageType<E>();
    field->set_type(Field::TYPE_MESSAGE);
    field->set_type_name("." + ProtobufMessages::FullName(MessageTraits<E>::kName));
  }
}

template <class E>
std::string SchemaBuilder::AddElements(const FieldInfo& info,
                                       const std::vector<std::string>& names) {
  constexpr std::string_view kCount = "num_";
  pb::DescriptorProto message;
  message.set_name(
      fmt::format("{}_{}", std::string_view(info.count).substr(kCount.size()), info.type));
  if (Has(message.name())) return message.name();
  std::set<std::string> taken;
  for (const std::string& name : names) {
    pb::FieldDescriptorProto* const field = message.add_field();
    field->set_name(FieldName(name, &taken));
    field->set_number(message.field_size());
    field->set_label(pb::FieldDescriptorProto::LABEL_OPTIONAL);
    SetType<E>(field);
  }
  *file_->add_message_type() = message;
  return message.name();
}

template <class F>
void SchemaBuilder::AddField(const char* name, pb::DescriptorProto* message) {
  using Field = pb::FieldDescriptorProto;
  using E = typename Element<F>::Type;
  Field* const field = message->add_field();
  field->set_name(name);
  field->set_number(message->field_size());
  const std::vector<std::string>& names = names_.Of(message->name(), name);
  if (!names.empty()) {
    field->set_label(Field::LABEL_OPTIONAL);
    field->set_type(Field::TYPE_MESSAGE);
    const std::string elements = AddElements<E>(*FirstField(message->name(), name), names);
    field->set_type_name("." + ProtobufMessages::FullName(elements));
    return;
  }
  field->set_label(Element<F>::kRepeated ? Field::LABEL_REPEATED : Field::LABEL_OPTIONAL);
  SetType<E>(field);
  if (Element<F>::kRepeated && std::is_arithmetic_v<E>) field->mutable_options()->set_packed(true);
}

template <class T>
void SchemaBuilder::AddMessageType() {
  if (Has(MessageTraits<T>::kName)) return;
  pb::DescriptorProto message;
  message.set_name(MessageTraits<T>::kName);
  const T none{};
  MessageTraits<T>::VisitFields(none, [&](const char* name, const auto& member) {
    AddField<std::remove_cvref_t<decltype(member)>>(name, &message);
  });
  *file_->add_message_type() = std::move(message);
}

/// False: an array has other than the named elements.
template <class T>
bool Fill(const T& from, pb::Message* to);

/// Sets a field, or appends to it, with one value.
template <class E>
bool Put(const E& value, const pb::FieldDescriptor* field, pb::Message* to) {
  const pb::Reflection& reflection = *to->GetReflection();
  const bool add = field->is_repeated();
  if constexpr (std::is_integral_v<E> && sizeof(E) <= 4) {
    add ? reflection.AddInt32(to, field, value) : reflection.SetInt32(to, field, value);
  } else if constexpr (std::is_integral_v<E>) {
    add ? reflection.AddInt64(to, field, value) : reflection.SetInt64(to, field, value);
  } else if constexpr (std::is_same_v<E, double>) {
    add ? reflection.AddDouble(to, field, value) : reflection.SetDouble(to, field, value);
  } else if constexpr (std::is_same_v<E, float>) {
    add ? reflection.AddFloat(to, field, value) : reflection.SetFloat(to, field, value);
  } else if constexpr (std::is_same_v<E, std::string>) {
    const std::string text = IsUtf8(value) ? value : LinesForTerminal(value);  // as Protobuf's are
    add ? reflection.AddString(to, field, text) : reflection.SetString(to, field, text);
  } else {
    return Fill(value,
                add ? reflection.AddMessage(to, field) : reflection.MutableMessage(to, field));
  }
  return true;
}

/// An array, repeated or with a field for each element.
template <class A>
bool PutAll(const A& values, const pb::FieldDescriptor* field, pb::Message* to) {
  bool good = true;
  if (field->is_repeated()) {
    for (const auto& value : values) good = Put(value, field, to) && good;
    return good;
  }
  pb::Message* const elements = to->GetReflection()->MutableMessage(to, field);
  if (elements->GetDescriptor()->field_count() != static_cast<int>(std::size(values))) return false;
  int index = 0;
  for (const auto& value : values) {
    good = Put(value, elements->GetDescriptor()->field(index++), elements) && good;
  }
  return good;
}

template <class T>
bool Fill(const T& from, pb::Message* to) {
  int index = 0;
  bool good = true;
  MessageTraits<T>::VisitFields(from, [&](const char*, const auto& member) {
    const pb::FieldDescriptor* const field = to->GetDescriptor()->field(index++);
    if constexpr (Element<std::remove_cvref_t<decltype(member)>>::kRepeated) {
      good = PutAll(member, field, to) && good;
    } else {
      good = Put(member, field, to) && good;
    }
  });
  return good;
}

}  // namespace

std::string ProtobufMessages::FullName(std::string_view type) {
  return "poise." + std::string(type);
}

ProtobufMessages::ProtobufMessages(const ElementNames& names) : factory_(&pool_) {
  pb::FileDescriptorSet set;
  pb::FileDescriptorProto* const file = set.add_file();
  file->set_name("poise/messages.proto");
  file->set_package("poise");
  file->set_syntax("proto2");
  SchemaBuilder builder(names, file);
  ForEachMessageType([&]<class T>() { builder.AddMessageType<T>(); });
  if (pool_.BuildFile(*file) == nullptr) {
    throw std::logic_error("the message types make no Protobuf file");
  }
  set.SerializeToString(&file_descriptor_set_);
}

std::optional<std::string> ProtobufMessages::Convert(std::string_view type,
                                                     std::span<const uint8_t> data) {
  std::optional<std::string> bytes;
  ForEachMessageType([&]<class T>() {
    if (type != MessageTraits<T>::kName) return;
    T message{};
    if (!DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &message)) return;
    const pb::Descriptor* const descriptor = pool_.FindMessageTypeByName(FullName(type));
    const std::unique_ptr<pb::Message> converted(factory_.GetPrototype(descriptor)->New());
    if (Fill(message, converted.get())) bytes = converted->SerializeAsString();
  });
  return bytes;
}

}  // namespace poise::logging
