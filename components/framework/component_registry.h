// The types of components that a program knows.
#pragma once

#include <map>
#include <string>

#include "components/framework/component_type.h"

namespace poise {

class ComponentRegistry {
 public:
  /// Throws ConfigError when there is one of that name.
  void Add(ComponentType type);
  void Add(std::string type, std::string summary, ComponentFactory factory,
           ComponentTraits traits = {}) {
    Add({std::move(type), std::move(summary), std::move(factory), std::move(traits)});
  }
  /// nullptr when there is no such type.
  const ComponentFactory* Find(const std::string& type) const;
  /// nullptr when there is no such type.
  const ComponentType* TypeNamed(const std::string& type) const;
  /// A type's traits; those of a type without any when there is no such type.
  const ComponentTraits& TraitsOf(const std::string& type) const;
  /// All types, by name.
  const std::map<std::string, ComponentType>& entries() const { return entries_; }

 private:
  std::map<std::string, ComponentType> entries_;
};

}  // namespace poise
