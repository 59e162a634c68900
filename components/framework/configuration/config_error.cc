#include "components/framework/configuration/config_error.h"

namespace poise {

ConfigError::ConfigError(std::string_view field, std::string_view problem)
    : std::runtime_error(std::string(field).append(": ").append(problem)),
      field_(field),
      problem_(problem) {}

}  // namespace poise
