// Fields of a message by their paths, "sim.push[0].peak".
#pragma once

#include <string>
#include <string_view>

namespace google::protobuf {
class Message;
}

namespace poise {

/// `path` with an index wherever it calls a list's element by its name ("check[push_peak].at_most":
/// its name, metric, joint, component, channel or link, the first of these fields that it has).
/// SetField takes such paths as well. Throws ConfigError where no element, or more than one, has
/// that name.
std::string ResolvePath(const google::protobuf::Message& message, std::string_view path);

/// Elements that `message` has at `path`: of a list, or 1 and 0 for a single field that is set and
/// not. A list on the way without an index means its first element; no element is called by its
/// name.
int CountField(const google::protobuf::Message& message, std::string_view path);

/// True when `message` sets the field at `path`; a list without an index has elements.
bool HasField(const google::protobuf::Message& message, std::string_view path);

/// Text of the value at `path` as a file has it, "0.1"; of a list, its first. Empty: it is not set,
/// or a group.
std::string ValueText(const google::protobuf::Message& message, std::string_view path);

/// Whether a setting is true, or a group is set. A group that is not set has no settings, whatever
/// their defaults are.
bool IsTrue(const google::protobuf::Message& message, std::string_view path);

/// Clears the field at `path`, which holds no index. False: it holds one, or the field is not set
/// or within a list.
bool ClearField(google::protobuf::Message* message, std::string_view path);

/// The group of fields at `path`, which holds no index; made where `message` has none.
google::protobuf::Message* MutableGroup(google::protobuf::Message* message, std::string_view path);

}  // namespace poise
