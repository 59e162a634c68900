// Versions of the libraries that this build uses.
#pragma once

#include <string>
#include <vector>

namespace poise {

/// "lcm 1.3.1", "ode 0.16.2", ..., and the compiler: what may move a run's last bits, for its log.
const std::vector<std::string>& LibraryVersions();

}  // namespace poise
