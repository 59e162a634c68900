// Fields of messages, by path.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "logging/element_names.h"
#include "poise/message_traits.hpp"

namespace poise {

/// One number or string of a message.
struct Scalar {
  std::string path;  ///< "foot_wrench[1].force[2]", or with names "foot_wrench[left].force[2]"
  std::variant<int64_t, double, std::string> value;
  std::string name = {};  ///< of an enumeration's value, "LOADING"; empty: it has none
};

/// All scalars of an encoded message, in order of declaration, elements called by `names`; none
/// when the bytes are not exactly one message of this type.
std::optional<std::vector<Scalar>> ReadScalars(const MessageType& type,
                                               std::span<const uint8_t> data,
                                               const logging::ElementNames& names = {});

/// An encoded message of these counts, all else zero, to look at its fields before one arrives.
/// The type must hold no strings.
std::vector<uint8_t> ZeroMessage(const MessageType& type, std::span<const int32_t> counts);

/// Parts of a message by path: a scalar ("torque[3]", "torque[right_knee_pitch]"), an array
/// ("torque") or a group ("foot_wrench[left]").
class FieldSelection {
 public:
  /// No fields: all of the message.
  explicit FieldSelection(std::vector<std::string> fields) : fields_(std::move(fields)) {}

  bool all() const { return fields_.empty(); }
  /// Elements by index are from here on those of their names, as ReadScalars calls them.
  void UseNames(const MessageType& type, const logging::ElementNames& names);
  /// Throws ConfigError when a field is none of the message's, with what it may have been.
  void Check(const MessageType& type, const std::vector<Scalar>& scalars) const;
  /// The selected scalars, field by field in the order asked for.
  std::vector<Scalar> Pick(const std::vector<Scalar>& scalars) const;

 private:
  std::vector<std::string> fields_;
};

}  // namespace poise
