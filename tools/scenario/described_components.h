// Component types that are programs in any language, known by what they say of themselves.
#pragma once

#include <filesystem>
#include <string>

#include "components/framework/component_type.h"

namespace poise {

/// Makes known the types of lib/poise/components/NAME.json in each folder of POISE_PATH: what
/// `lib/poise/bin/NAME --describe` prints (name, summary, inputs, outputs). Once, after LoadModules
/// and before Components. A file that is no such description is said on stderr and left out.
void LoadDescriptions();

/// Whether the type is one of them: it cannot run in another's process.
bool IsDescribed(const std::string& type);

/// One of them. Throws ConfigError.
ComponentType ReadDescription(const std::filesystem::path& file);

}  // namespace poise
