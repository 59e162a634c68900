// What rule.proto says of a configuration's numbers, read by one checker for every component.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <initializer_list>
#include <string>

namespace poise {

/// Throws ConfigError with the path of the first number that is not finite or that its field's rule
/// does not allow, with its value and with what is allowed. A field that is not set is taken for
/// good. `prefix`: of the paths, with its dot ("sim.").
void CheckFields(const google::protobuf::Message& config, const std::string& prefix = "");

/// Throws ConfigError with the path of the first of the fields `names` that is not set, and with
/// what its rule allows.
void RequireFields(const google::protobuf::Message& config,
                   std::initializer_list<const char*> names, const std::string& prefix = "");

/// What the field's rule allows: "greater than 0", "0 to 1"; empty: any number.
std::string RangeOf(const google::protobuf::FieldDescriptor& field);

}  // namespace poise
