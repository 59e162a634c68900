// Users' own code: a module is a shared library with components, messages, metrics and drive buses,
// made with poise_module() of the CMake package and found on POISE_PATH.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "components/framework/component_type.h"

namespace poise {

/// Makes a component type known; called by a module's POISE_MODULE.
void AddComponent(ComponentType type);
/// The types that were added, in that order.
const std::vector<ComponentType>& AddedComponents();

/// Folders with files of users' own, first those of $POISE_PATH (parted by colons), then where
/// Poise itself is installed: lib/poise/modules holds modules, lib/poise/bin programs, share/poise
/// scenarios, graphs, robots, sweeps and drives, a folder each.
std::vector<std::filesystem::path> PoisePath();

/// Where this Poise is installed; empty: it runs from its build.
std::filesystem::path InstalledPrefix();

/// A program of PoisePath, else beside this one. Throws ConfigError naming the paths that were
/// searched.
std::filesystem::path FindProgram(const std::string& name);

/// Loads all modules of PoisePath, once. Throws ConfigError naming the file: it cannot be loaded,
/// was built against another Poise, or brings what is there already.
void LoadModules();
/// "modules with others are looked for in ...": where, for an error that something is not known.
std::string ModulesSearched();

}  // namespace poise
