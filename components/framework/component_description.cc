#include "components/framework/component_description.h"

#include <google/protobuf/descriptor.h>

#include "components/framework/configuration/field_reference.h"
#include "components/framework/optional_ports.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

const char* KindName(InputKind kind) {
  return kind == InputKind::kSameTick       ? "same tick"
         : kind == InputKind::kPreviousTick ? "tick before"
                                            : "latest";
}

Json Setting(const FieldEntry& field) {
  Json setting = {{"path", field.path}, {"type", field.type}};
  if (!field.default_value.empty()) setting["default"] = field.default_value;
  if (!field.unit.empty()) setting["unit"] = field.unit;
  setting["meaning"] = field.meaning;
  for (const auto& [value, meaning] : field.values) setting["values"][value] = meaning;
  return setting;
}

}  // namespace

Json DescriptionOf(const ComponentType& type) {
  Json description = {{"name", type.name}, {"summary", type.summary}};
  description["inputs"] = Json::array();
  description["outputs"] = Json::array();
  for (const PortType& port : type.ports) {
    Json entry = {{"name", port.name}, {"type", port.type}};
    if (port.input) entry["kind"] = KindName(port.kind);
    description[port.input ? "inputs" : "outputs"].push_back(entry);
  }
  for (const OptionalPort& port : OptionalPortsOf(type.name)) {
    Json entry = {{"name", port.port}, {"type", port.type}};
    if (port.input) entry["kind"] = KindName(port.kind);
    if (!port.when.empty()) entry["when"] = port.when;
    if (!port.unless.empty()) entry["unless"] = port.unless;
    description[port.input ? "inputs" : "outputs"].push_back(entry);
  }
  if (type.config != nullptr) description["configuration"] = type.config->full_name();
  description["settings"] = Json::array();
  if (type.config != nullptr && type.schema != nullptr) {
    AddSchema(type.schema());
    const bool own = type.traits.sections.size() < 2;  // else the sections' names come first
    const std::string section = type.traits.sections.empty() ? type.name : type.traits.sections[0];
    for (const FieldEntry& field :
         FieldsOfType(type.config->full_name(), own ? section + "." : "")) {
      if (!field.group) description["settings"].push_back(Setting(field));
    }
  }
  for (const RemovablePart& part : type.traits.parts) {
    description["parts"][part.name] = part.field;
  }
  if (!type.traits.engine.empty()) description["engine"] = type.traits.engine;
  return description;
}

}  // namespace poise
