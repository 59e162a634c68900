// Checks of what a command line says.
#pragma once

#include <functional>
#include <string>

namespace poise {

/// "TEXT: must be RANGE" for what is no number or not `good`; NaN never is. For CLI::Option::check.
std::function<std::string(const std::string&)> Within(const char* range, bool (*good)(double));

/// "TEXT: must be a whole number ..." for what is none from 0 to 2^64 - 1. For CLI::Option::check,
/// since the parser alone takes -1 and more digits for the largest.
std::function<std::string(const std::string&)> Whole();

}  // namespace poise
