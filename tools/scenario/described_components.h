// Component types that are programs in any language, known by what they say of themselves.
#pragma once

#include <filesystem>
#include <vector>

#include "components/framework/component_type.h"

namespace poise {

/// The types of lib/poise/components/NAME.json in each folder of POISE_PATH: what
/// `lib/poise/bin/NAME --describe` prints (name, summary, inputs, outputs). In the order of the
/// files' names. Throws ConfigError naming the file: it is no such description.
std::vector<ComponentType> DescribedComponents();

/// One of them. Throws ConfigError.
ComponentType ReadDescription(const std::filesystem::path& file);

}  // namespace poise
