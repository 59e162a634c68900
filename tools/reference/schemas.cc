#include "tools/reference/schemas.h"

#include <google/protobuf/descriptor.h>

#include <array>

#include "components/framework/modules.h"
#include "hw_bridge/drive_buses.h"

namespace poise {

std::string_view EmbeddedSchemas();  // a FileDescriptorSet with source information

std::vector<FieldEntry> FieldReference(Schema schema) {
  static constexpr std::array kNames = {"poise.Scenario", "poise.Robot", "poise.Sweep",
                                        "poise.Graph"};
  AddSchema(EmbeddedSchemas());
  std::vector<FieldEntry> entries = FieldsOfType(kNames[static_cast<size_t>(schema)]);
  if (schema != Schema::kScenario) return entries;
  for (const ComponentType& type : AddedComponents()) {
    if (type.config == nullptr || type.schema == nullptr) continue;
    AddSchema(type.schema());
    for (FieldEntry& entry : FieldsOfGroup(type.config->full_name(), type.name)) {
      entries.push_back(std::move(entry));
    }
  }
  for (const DriveBusType& bus : DriveBuses()) {
    if (bus.schema == nullptr) continue;  // the bridge's own schema has it
    AddSchema(bus.schema());
    for (FieldEntry& entry : FieldsOfGroup(bus.config->full_name(), "hw_bridge." + bus.name)) {
      entries.push_back(std::move(entry));
    }
  }
  return entries;
}

}  // namespace poise
