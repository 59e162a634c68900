#include "lcmtypes/field_table.h"

#include <algorithm>
#include <map>

namespace poise {

MessageSet poise_messages();    // generated
MessageSet operate_messages();  // generated
MessageSet steps_messages();    // generated
MessageSet derived_messages();  // generated

namespace {

struct Known {
  Known() {
    types.reserve(kMostTypes);  // pointers to them last
    Add(poise_messages());
    Add(operate_messages());
    Add(steps_messages());
    Add(derived_messages());
  }

  void Add(const MessageSet& set) {
    for (const MessageType& type : set.types) {
      const auto same = [&](const MessageType& other) {
        return std::string_view(other.name) == type.name || other.fingerprint == type.fingerprint;
      };
      if (std::any_of(types.begin(), types.end(), same)) {
        problems.push_back(std::string("message ") + type.name + " is there twice");
      } else if (types.size() == kMostTypes) {
        problems.push_back(std::string("message ") + type.name + " is one too many");
      } else {
        types.push_back(type);
      }
    }
    for (const StructInfo& each : set.structs) structs.emplace(each.name, each.fields);
    definitions.insert(definitions.end(), set.definitions.begin(), set.definitions.end());
  }

  static constexpr size_t kMostTypes = 4096;
  std::vector<MessageType> types;
  std::map<std::string_view, std::span<const FieldInfo>> structs;
  std::vector<std::string_view> definitions;
  std::vector<std::string> problems;
};

Known& TheKnown() {
  static Known known;
  return known;
}

}  // namespace

bool AddMessages(const MessageSet& set) {
  TheKnown().Add(set);
  return true;
}

const std::vector<std::string>& MessageProblems() { return TheKnown().problems; }

const std::vector<std::string_view>& MessageDefinitions() { return TheKnown().definitions; }

std::span<const MessageType> MessageTypes() { return TheKnown().types; }

const MessageType* FindMessageType(std::string_view name) {
  for (const MessageType& type : MessageTypes()) {
    if (name == type.name) return &type;
  }
  return nullptr;
}

const MessageType* FindMessageType(int64_t fingerprint) {
  for (const MessageType& type : MessageTypes()) {
    if (fingerprint == type.fingerprint) return &type;
  }
  return nullptr;
}

std::span<const FieldInfo> FieldsOf(std::string_view type) {
  const auto& structs = TheKnown().structs;
  const auto found = structs.find(type);
  return found == structs.end() ? std::span<const FieldInfo>() : found->second;
}

const FieldInfo* FirstField(std::string_view type, std::string_view path) {
  const std::string_view name = path.substr(0, path.find_first_of(".["));
  const std::span<const FieldInfo> fields = FieldsOf(type);
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const FieldInfo& f) { return name == f.name; });
  return found != fields.end() ? &*found : nullptr;
}

std::string_view UnitOf(std::string_view type, std::string_view path) {
  const FieldInfo* const field = FirstField(type, path);
  if (field == nullptr) return "";
  const size_t dot = path.find('.');
  return dot == std::string_view::npos ? field->unit : UnitOf(field->type, path.substr(dot + 1));
}

}  // namespace poise
