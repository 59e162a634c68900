// Where scenarios, robots and graphs are found by name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace poise {

/// The deploy folder: $POISE_DEPLOY_DIR, else that of the source this program was built from.
std::filesystem::path DeployDir();

/// File of the scenario, robot or graph (`kind`: "scenarios", ...) that `name` means: a path (it
/// holds a '/' and exists relative to `base`, or ends in .pbtxt), or the name of a file of
/// deploy/`kind` without its ending. Throws ConfigError naming what there is.
std::filesystem::path FindFile(const std::string& kind, const std::string& name,
                               const std::filesystem::path& base);

/// Names that FindFile takes, sorted. What is in a folder named base is not: files that others are
/// based on.
std::vector<std::string> ListNames(const std::string& kind);

}  // namespace poise
