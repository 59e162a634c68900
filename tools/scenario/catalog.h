// Where scenarios, sweeps, robots, graphs and drives are found.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace poise {

/// The installed files: $POISE_DEPLOY_DIR, else deploy/ of the source this program was built from.
std::filesystem::path DeployDir();

/// Whether a name may mean a file in a folder named base: one that others are based on, not to be
/// used by itself.
enum class BaseFiles { kRefused, kTaken };

/// The file of a `kind` ("scenarios", "robots", ...) that `name` means, by the one rule for all of
/// them: NAME or NAME.pbtxt beside the file that names it, in `beside` (for a name of the command
/// line: the current folder), then in deploy/`kind`. A name that ends in .pbtxt means no other
/// ending; an absolute one is looked for only there.
std::optional<std::filesystem::path> LookForFile(const std::string& kind, const std::string& name,
                                                 const std::filesystem::path& beside,
                                                 BaseFiles bases = BaseFiles::kRefused);

/// The same. Throws ConfigError naming the paths that were searched, and names that are near.
std::filesystem::path FindFile(const std::string& kind, const std::string& name,
                               const std::filesystem::path& beside,
                               BaseFiles bases = BaseFiles::kRefused);

/// FindFile of a name that may be of several kinds: the first kind that has it.
std::filesystem::path FindFileOfKinds(const std::vector<std::string>& kinds,
                                      const std::string& name, const std::filesystem::path& beside);

/// Names of the files in deploy/`kind`, sorted, those in a folder named base aside.
std::vector<std::string> ListNames(const std::string& kind);

/// The file of deploy/`kind` with one of these names.
std::filesystem::path InstalledFile(const std::string& kind, const std::string& name);

}  // namespace poise
