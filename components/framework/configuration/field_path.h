// Paths of fields that name an element of a list by its own name.
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

}  // namespace poise
