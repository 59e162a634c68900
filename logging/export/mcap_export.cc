#include <map>

#include "components/framework/build_info.h"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"
#include "logging/derived/derived_reader.h"
#include "logging/export/log_export.h"
#include "logging/export/mcap_writer.h"
#include "logging/export/protobuf_messages.h"
#include "logging/log_messages.h"
#include "logging/printable.h"

namespace poise::logging {
namespace {

McapWriter::Texts RunTexts(const LogMessages& messages) {
  const RunSpec& spec = messages.spec();
  McapWriter::Texts texts = {{"scenario", spec.scenario()},
                             {"run_id", fmt::format("{}", spec.run_id())},
                             {"seed", fmt::format("{}", spec.seed())},
                             {"started_at", messages.info().started_at},
                             {"poise", spec.poise_version()}};
  for (const std::string& version : spec.library_version()) {
    const size_t space = version.find(' ');
    if (space != std::string::npos) texts[version.substr(0, space)] = version.substr(space + 1);
  }
  McapWriter::Texts utf8;  // as MCAP's texts are; a log may hold any bytes
  for (const auto& [name, text] : texts) utf8[ForTerminal(name)] = ForTerminal(text);
  return utf8;
}

/// Units by "type.field", of the structs in messages too.
McapWriter::Texts Units() {
  McapWriter::Texts units;
  const auto add = [&](const auto& self, const std::string& type) -> void {
    for (const FieldInfo& field : FieldsOf(type)) {
      if (*field.unit != '\0') units[type + "." + field.name] = field.unit;
      self(self, field.type);
    }
  };
  for (const MessageType& type : MessageTypes()) add(add, type.name);
  return units;
}

}  // namespace

std::vector<ExportedChannel> ExportMcap(const std::string& log, const std::string& file,
                                        McapTopics* more) {
  LogMessages messages(log, LogMessages::Run::kIfKnown);
  ProtobufMessages protobuf(messages.names());
  McapWriter writer(file, fmt::format("poise {}", PoiseVersion()));
  if (messages.run_known()) writer.AddMetadata("run", RunTexts(messages));
  writer.AddMetadata("units", Units());
  if (more != nullptr) more->Begin(&writer);
  std::map<std::string, uint16_t> schemas;  // by type
  struct Topic {
    uint16_t id;
    const MessageType* type;
    size_t result;
  };
  std::map<std::string, Topic, std::less<>> topics;
  std::vector<ExportedChannel> results;
  LogReader all(log);  // with RUN_INFO
  DerivedReader events(&all, messages);
  LogEvent event;
  while (events.Next(&event)) {
    const MessageType* const type = messages.TypeOf(event);
    auto topic = topics.find(event.channel);
    if (topic == topics.end()) {
      topic = topics.emplace(event.channel, Topic{0, nullptr, results.size()}).first;
      results.push_back({std::string(event.channel), "", 0, 0});
    }
    ExportedChannel& result = results[topic->second.result];
    std::optional<std::string> bytes;
    if (type != nullptr && IsPlainUtf8(event.channel) && event.utime >= 0 &&
        event.utime < INT64_MAX / 1000 &&
        (topic->second.type == nullptr || topic->second.type == type)) {
      bytes = protobuf.Convert(type->name, event.data);
    }
    if (!bytes) {
      ++result.refused;
      continue;
    }
    if (topic->second.type == nullptr) {
      if (!schemas.contains(type->name)) {
        schemas[type->name] = writer.AddSchema(ProtobufMessages::FullName(type->name), "protobuf",
                                               protobuf.file_descriptor_set());
      }
      topic->second.type = type;
      topic->second.id = writer.AddChannel(schemas[type->name], result.channel, "protobuf",
                                           {{"lcm_type", type->name}});
      result.type = type->name;
    }
    writer.AddMessage(topic->second.id, static_cast<uint32_t>(result.messages),
                      static_cast<uint64_t>(event.utime) * 1000, *bytes);
    ++result.messages;
    if (more != nullptr) more->Add(*type, event, &writer);
  }
  if (more != nullptr) more->End(&writer);
  writer.Close();
  return results;
}

}  // namespace poise::logging
