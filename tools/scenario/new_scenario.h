// A scenario file of one's own, to begin with.
#pragma once

#include <filesystem>
#include <string>

namespace poise {

/// The text of a new scenario `name` for a file in `folder`: `from`'s (LookForFile's rule, from
/// `folder`) with its comments; empty: a short one with a push, which says what may be changed.
/// Files that it names and that would not be found from `folder` are named by their whole path.
/// Throws ConfigError.
std::string NewScenarioText(const std::string& name, const std::string& from,
                            const std::filesystem::path& folder);

}  // namespace poise
