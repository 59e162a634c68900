// What rule.proto says of a configuration's numbers, read by one checker for every component.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <string>

namespace poise {

/// Throws ConfigError with the path of the first number that is not finite or that its field's rule
/// does not allow, with its value and with what is allowed. A field that is not set is taken for
/// good. `prefix`: of the paths, with its dot ("sim.").
void CheckFields(const google::protobuf::Message& config, const std::string& prefix = "");

/// Throw ConfigError in the same words for a number that stands in no message.
void CheckPositive(double value, const std::string& field);
void CheckNotNegative(double value, const std::string& field);

/// What the field's rule allows: "greater than 0", "0 to 1"; empty: any number.
std::string RangeOf(const google::protobuf::FieldDescriptor& field);

}  // namespace poise
