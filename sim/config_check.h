// Checks of configured numbers, with the field's path in the error.
#pragma once

#include <cmath>
#include <string>

#include "components/framework/configuration/configuration.h"

namespace poise {

/// Throws ConfigError unless the number is finite.
inline void RequireFinite(double value, const std::string& field) {
  if (!std::isfinite(value)) throw ConfigError(field, "must be a finite number");
}

/// Throws ConfigError unless the number is finite and > 0.
inline void RequirePositive(double value, const std::string& field) {
  if (!std::isfinite(value) || value <= 0) throw ConfigError(field, "must be greater than 0");
}

/// Throws ConfigError unless the number is finite and >= 0.
inline void RequireNotNegative(double value, const std::string& field) {
  if (!std::isfinite(value) || value < 0) throw ConfigError(field, "must not be negative");
}

}  // namespace poise
