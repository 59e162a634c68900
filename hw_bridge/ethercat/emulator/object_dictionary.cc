#include "hw_bridge/ethercat/emulator/object_dictionary.h"

#include <utility>

namespace poise::ethercat {

ObjectDictionary::Object* ObjectDictionary::Add(ObjectAddress address, uint8_t size, uint8_t access,
                                                uint32_t value,
                                                std::function<SdoAbort(uint32_t)> on_write) {
  Object& object = objects_[address];
  object = {.size = size, .access = access, .value = value, .on_write = std::move(on_write)};
  return &object;
}

const ObjectDictionary::Object* ObjectDictionary::Find(ObjectAddress address) const {
  const auto found = objects_.find(address);
  return found != objects_.end() ? &found->second : nullptr;
}

ObjectDictionary::Object* ObjectDictionary::Find(ObjectAddress address) {
  return const_cast<Object*>(std::as_const(*this).Find(address));
}

SdoAbort ObjectDictionary::Missing(ObjectAddress address) const {
  const auto next = objects_.lower_bound({address.index, 0});
  return next != objects_.end() && next->first.index == address.index ? SdoAbort::kNoSubindex
                                                                      : SdoAbort::kNoObject;
}

SdoAbort ObjectDictionary::Read(ObjectAddress address, uint32_t* value, uint8_t* size) const {
  const Object* object = Find(address);
  if (object == nullptr) return Missing(address);
  *value = object->value;
  *size = object->size;
  return SdoAbort::kNone;
}

SdoAbort ObjectDictionary::Write(ObjectAddress address, uint32_t value, uint8_t size) {
  Object* object = Find(address);
  if (object == nullptr) return Missing(address);
  if ((object->access & kWritable) == 0) return SdoAbort::kReadOnly;
  if (size > object->size) return SdoAbort::kLengthTooHigh;
  if (size < object->size) return SdoAbort::kLengthTooLow;
  if (object->on_write) {
    const SdoAbort abort = object->on_write(value);
    if (abort != SdoAbort::kNone) return abort;
  }
  object->value = value;
  return SdoAbort::kNone;
}

}  // namespace poise::ethercat
