// Configuration: protobuf text files with errors that name file, line and field.
#pragma once

#include <string>
#include <string_view>

#include "components/framework/configuration/config_error.h"

namespace google::protobuf {
class Message;
}

namespace poise {

/// Parses protobuf text. Throws ConfigError "source:line:column: problem"; enum values that there
/// are not are errors, and so are fields, but those of whose complaint `passes_over` is true.
void ParseTextProto(std::string_view text, std::string_view source,
                    google::protobuf::Message* message,
                    bool (*passes_over)(std::string_view complaint) = nullptr);

/// Reads and parses a file. Throws ConfigError when it cannot be read.
void ReadTextProto(const std::string& path, google::protobuf::Message* message);

/// Whole file as text. Throws ConfigError naming the file and the reason.
std::string ReadFile(const std::string& path);

/// Line (from 1) of the field with dotted path `field` ("task_controller.phase[2].duration") in
/// `text`, parsed as a message of the type of `prototype`; the nearest enclosing field present in
/// the text; 0 when none is.
int LocateField(std::string_view text, std::string_view field,
                const google::protobuf::Message& prototype);

/// Sets one field by dotted path from text ("sim.push[0].peak", "120"); an empty text clears a
/// list or a group of fields ("sim.push", ""). Throws ConfigError naming the path, the nearest
/// valid names and the expected type. An index may be that of an element or one past the end.
void SetField(google::protobuf::Message* message, std::string_view path, std::string_view value);

}  // namespace poise
