// The bus's messages as Protobuf messages, for tools that know Protobuf and not LCM.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "logging/element_names.h"

namespace poise::logging {

/// Schemas made from the LCM types at run time: message poise.NAME with the same field names in the
/// same order, numbered from 1; integers of 32 bits and less are int32, longer ones int64, arrays
/// repeated; but an array of named elements is a message with a field for each, so that viewers
/// show torque.right_knee_pitch. proto2, so that a zero is written too.
class ProtobufMessages {
 public:
  explicit ProtobufMessages(const ElementNames& names);

  /// A serialised google.protobuf.FileDescriptorSet with all types.
  const std::string& file_descriptor_set() const { return file_descriptor_set_; }
  /// "poise.robot_state_t"; of package ankle: "poise.ankle_sway_t"
  static std::string FullName(std::string_view type);
  /// An encoded LCM message of a type, as Protobuf; empty: not such a message, or with other than
  /// the named elements. A text that is no
  /// UTF-8 becomes printable.
  std::optional<std::string> Convert(std::string_view type, std::span<const uint8_t> data);

 private:
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_;
  std::string file_descriptor_set_;
};

}  // namespace poise::logging
