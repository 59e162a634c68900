// What a component is, without its class.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/framework/component.h"
#include "components/framework/component_traits.h"

namespace google::protobuf {
class Descriptor;
}

namespace poise {

/// A port as its component's Configure declares it in every configuration.
struct PortType {
  std::string name;
  std::string type;  ///< of its messages, as MessageType::name
  bool input = true;
  InputKind kind = InputKind::kSameTick;  ///< of an input
};

template <class T>
PortType Reads(std::string name, InputKind kind = InputKind::kSameTick) {
  return {std::move(name), MessageTraits<T>::kName, true, kind};
}
template <class T>
PortType Writes(std::string name) {
  return {std::move(name), MessageTraits<T>::kName, false};
}

/// Each component's folder has a function that gives its own.
struct ComponentType {
  std::string name;     ///< of the type, of its program and of its group of fields in a scenario
  std::string summary;  ///< a line for `poise list components`
  ComponentFactory make;
  ComponentTraits traits = {};
  /// A graph that does not fit them is refused before anything is configured, as is a component
  /// that declares others. None: known only once it is configured.
  std::vector<PortType> ports = {};
  /// Type of its configuration; nullptr: it has none.
  const google::protobuf::Descriptor* config = nullptr;
  /// The configuration's schema with its comments, a serialised FileDescriptorSet:
  /// poise_proto_library makes a function NAME_schema() that gives it.
  std::string_view (*schema)() = nullptr;
};

}  // namespace poise
