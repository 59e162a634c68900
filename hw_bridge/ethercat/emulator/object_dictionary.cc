#include "hw_bridge/ethercat/emulator/object_dictionary.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hw_bridge/ethercat/links/bytes.h"

namespace poise::ethercat {

uint16_t ObjectDictionary::Object::data_type() const {
  constexpr uint16_t kVisibleString = 0x0009;
  constexpr uint16_t kUnsigned[] = {0x0005, 0x0006, 0x0016, 0x0007};
  constexpr uint16_t kSigned[] = {0x0002, 0x0003, 0x0010, 0x0004};
  if (size == 0) return kVisibleString;
  return is_signed ? kSigned[size - 1] : kUnsigned[size - 1];
}

ObjectDictionary::Object* ObjectDictionary::Add(ObjectAddress address, uint8_t size, uint8_t access,
                                                uint32_t value,
                                                std::function<SdoAbort(uint32_t)> on_write) {
  Object& object = objects_[address];
  object = {.size = size, .access = access, .value = value, .on_write = std::move(on_write)};
  return &object;
}

ObjectDictionary::Object* ObjectDictionary::AddText(ObjectAddress address, std::string text,
                                                    size_t most) {
  Object* object = Add(address, 0, most > 0 ? kWritable : kReadOnly);
  object->text = std::move(text);
  object->most_text = most;
  return object;
}

std::string ObjectDictionary::NameOf(uint16_t index) const {
  const auto first = objects_.lower_bound({index, 0});
  const bool named = first != objects_.end() && first->first.index == index;
  return named && !first->second.name.empty() ? first->second.name
                                              : fmt::format("object {:04X}", index);
}

const ObjectDictionary::Object* ObjectDictionary::Find(ObjectAddress address) const {
  const auto found = objects_.find(address);
  return found != objects_.end() ? &found->second : nullptr;
}

ObjectDictionary::Object* ObjectDictionary::Find(ObjectAddress address) {
  return const_cast<Object*>(std::as_const(*this).Find(address));
}

int ObjectDictionary::MaxSubindex(uint16_t index) const {
  const auto after = objects_.upper_bound({index, 0xFF});
  if (after == objects_.begin()) return -1;
  const ObjectAddress& last = std::prev(after)->first;
  return last.index == index ? last.subindex : -1;
}

SdoAbort ObjectDictionary::Missing(ObjectAddress address) const {
  return MaxSubindex(address.index) >= 0 ? SdoAbort::kNoSubindex : SdoAbort::kNoObject;
}

SdoAbort ObjectDictionary::Read(ObjectAddress address, std::vector<uint8_t>* data) const {
  const Object* object = Find(address);
  if (object == nullptr) return Missing(address);
  if (object->size == 0) {
    data->insert(data->end(), object->text.begin(), object->text.end());
    return SdoAbort::kNone;
  }
  const size_t at = data->size();
  data->resize(at + object->size);
  PutSized(*data, at, object->value, object->size);
  return SdoAbort::kNone;
}

SdoAbort ObjectDictionary::Write(ObjectAddress address, std::span<const uint8_t> data) {
  Object* object = Find(address);
  if (object == nullptr) return Missing(address);
  if ((object->access & kWritable) == 0) return SdoAbort::kReadOnly;
  if (object->size == 0) {
    if (data.size() > object->most_text) return SdoAbort::kLengthTooHigh;
    object->text.assign(data.begin(), data.end());
    return SdoAbort::kNone;
  }
  if (data.size() > object->size) return SdoAbort::kLengthTooHigh;
  if (data.size() < object->size) return SdoAbort::kLengthTooLow;
  const auto value = static_cast<uint32_t>(GetSized(data, 0, data.size()));
  const SdoAbort abort = object->on_write ? object->on_write(value) : SdoAbort::kNone;
  if (abort == SdoAbort::kNone) object->value = value;
  return abort;
}

SdoAbort ObjectDictionary::ReadComplete(ObjectAddress address, std::vector<uint8_t>* data) const {
  const int most = MaxSubindex(address.index);
  if (most < 0) return SdoAbort::kNoObject;
  if (address.subindex > 1) return SdoAbort::kUnsupportedAccess;
  // Subindex 0 of a list says how many elements there are.
  const Object* count = Find({address.index, 0});
  const bool list = most > 0 && count != nullptr && count->size == 1;
  const int last = list ? std::min(most, static_cast<int>(count->value)) : most;
  for (int i = address.subindex; i <= last; ++i) {
    const SdoAbort abort = Read({address.index, static_cast<uint8_t>(i)}, data);
    if (abort != SdoAbort::kNone) return abort;
    if (i == 0 && list) data->push_back(0);
  }
  return SdoAbort::kNone;
}

SdoAbort ObjectDictionary::WriteComplete(ObjectAddress address, std::span<const uint8_t> data) {
  const int most = MaxSubindex(address.index);
  if (most < 0) return SdoAbort::kNoObject;
  if (address.subindex > 1) return SdoAbort::kUnsupportedAccess;
  // The count is written last: entries are free only while it is 0.
  const bool counted = address.subindex == 0 && most > 0;
  if (counted) {
    if (data.size() < 2) return SdoAbort::kLengthTooLow;
    const uint8_t none = 0;
    const SdoAbort abort = Write({address.index, 0}, std::span(&none, 1));
    if (abort != SdoAbort::kNone) return abort;
  }
  size_t at = counted ? 2 : 0;
  for (int i = counted ? 1 : address.subindex; at < data.size(); ++i) {
    const Object* object = Find({address.index, static_cast<uint8_t>(i)});
    if (object == nullptr) return SdoAbort::kLengthTooHigh;
    const size_t size = object->size > 0 ? object->size : data.size() - at;
    if (data.size() - at < size) return SdoAbort::kLengthTooLow;
    const SdoAbort abort = Write({address.index, static_cast<uint8_t>(i)}, data.subspan(at, size));
    if (abort != SdoAbort::kNone) return abort;
    at += size;
  }
  return counted ? Write({address.index, 0}, data.first(1)) : SdoAbort::kNone;
}

}  // namespace poise::ethercat
