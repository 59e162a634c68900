// What a shell and man need to know of a command line, made of its own option tables.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace poise {

/// The manual page of `app` with all its commands, in man's own language. `version` stands below.
std::string ManPage(const CLI::App& app, const std::string& version);

/// Completion of commands, flags, values of flags that take one of a few, names of scenarios and
/// robots (asked for with `poise shell names KIND`), and files.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);
std::string FishCompletion(const CLI::App& app);

}  // namespace poise
