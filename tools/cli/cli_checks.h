// Checks of what a command line says.
#pragma once

#include <functional>
#include <string>

namespace poise {

/// "TEXT: must be RANGE" for what is no number or not `good`; NaN never is. For CLI::Option::check.
std::function<std::string(const std::string&)> Within(const char* range, bool (*good)(double));

}  // namespace poise
