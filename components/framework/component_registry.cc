#include "components/framework/component_registry.h"

#include "fmt/format.h"

namespace poise {

void ComponentRegistry::Add(ComponentType type) {
  const std::string name = type.name;
  if (!entries_.emplace(name, std::move(type)).second) {
    throw ConfigError(fmt::format("component type {} is registered twice", name));
  }
}

const ComponentFactory* ComponentRegistry::Find(const std::string& type) const {
  const ComponentType* const found = TypeNamed(type);
  return found == nullptr ? nullptr : &found->make;
}

const ComponentType* ComponentRegistry::TypeNamed(const std::string& type) const {
  const auto found = entries_.find(type);
  return found == entries_.end() ? nullptr : &found->second;
}

const ComponentTraits& ComponentRegistry::TraitsOf(const std::string& type) const {
  static const ComponentTraits none;
  const ComponentType* const found = TypeNamed(type);
  return found == nullptr ? none : found->traits;
}

}  // namespace poise
