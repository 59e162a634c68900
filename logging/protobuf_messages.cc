#include "logging/protobuf_messages.h"

#include <google/protobuf/descriptor.pb.h>

#include <stdexcept>
#include <type_traits>

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

template <class T>
void AddMessageType(pb::FileDescriptorProto* file);

template <class F>
void AddField(const char* name, pb::DescriptorProto* message, pb::FileDescriptorProto* file) {
  using Field = pb::FieldDescriptorProto;
  using E = typename Element<F>::Type;
  Field* const field = message->add_field();
  field->set_name(name);
  field->set_number(message->field_size());
  field->set_label(Element<F>::kRepeated ? Field::LABEL_REPEATED : Field::LABEL_OPTIONAL);
  if constexpr (std::is_integral_v<E>) {
    field->set_type(sizeof(E) <= 4 ? Field::TYPE_INT32 : Field::TYPE_INT64);
  } else if constexpr (std::is_same_v<E, double>) {
    field->set_type(Field::TYPE_DOUBLE);
  } else if constexpr (std::is_same_v<E, float>) {
    field->set_type(Field::TYPE_FLOAT);
  } else if constexpr (std::is_same_v<E, std::string>) {
    field->set_type(Field::TYPE_STRING);
  } else {
    AddMessageType<E>(file);
    field->set_type(Field::TYPE_MESSAGE);
    field->set_type_name("." + ProtobufMessages::FullName(MessageTraits<E>::kName));
  }
  if (Element<F>::kRepeated && std::is_arithmetic_v<E>) field->mutable_options()->set_packed(true);
}

template <class T>
void AddMessageType(pb::FileDescriptorProto* file) {
  for (const pb::DescriptorProto& type : file->message_type()) {
    if (type.name() == MessageTraits<T>::kName) return;
  }
  pb::DescriptorProto message;
  message.set_name(MessageTraits<T>::kName);
  const T none{};
  MessageTraits<T>::VisitFields(none, [&](const char* name, const auto& member) {
    AddField<std::remove_cvref_t<decltype(member)>>(name, &message, file);
  });
  *file->add_message_type() = std::move(message);
}

template <class T>
void Fill(const T& from, pb::Message* to);

/// Sets a field, or appends to it, with one value.
template <class E>
void Put(const E& value, const pb::FieldDescriptor* field, pb::Message* to) {
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
    Fill(value, add ? reflection.AddMessage(to, field) : reflection.MutableMessage(to, field));
  }
}

template <class T>
void Fill(const T& from, pb::Message* to) {
  int index = 0;
  MessageTraits<T>::VisitFields(from, [&](const char*, const auto& member) {
    const pb::FieldDescriptor* const field = to->GetDescriptor()->field(index++);
    if constexpr (Element<std::remove_cvref_t<decltype(member)>>::kRepeated) {
      for (const auto& value : member) Put(value, field, to);
    } else {
      Put(member, field, to);
    }
  });
}

}  // namespace

std::string ProtobufMessages::FullName(std::string_view type) {
  return "poise." + std::string(type);
}

ProtobufMessages::ProtobufMessages() : factory_(&pool_) {
  pb::FileDescriptorSet set;
  pb::FileDescriptorProto* const file = set.add_file();
  file->set_name("poise/messages.proto");
  file->set_package("poise");
  file->set_syntax("proto2");
  ForEachMessageType([&]<class T>() { AddMessageType<T>(file); });
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
    Fill(message, converted.get());
    bytes = converted->SerializeAsString();
  });
  return bytes;
}

}  // namespace poise::logging
