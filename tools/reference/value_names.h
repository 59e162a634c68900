// Names of the values of messages' enumerations, as their .lcm files give them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace poise {

/// "LOADING" of STEPPING_LOADING, for the field "stepping" of "planner_status_t", whose comment
/// names STEPPING_*; empty for a number that has no name, and for the fields of nested structs.
/// `path` may go on with an index.
std::string ValueName(std::string_view type, std::string_view path, int64_t value);

}  // namespace poise
