// Where scenarios, sweeps, robots, graphs and drives are found.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace poise {

/// Poise's own files: $POISE_DEPLOY_DIR, else share/poise where it is installed, else deploy/ of
/// the source this program was built from.
std::filesystem::path DeployDir();

/// Where files are looked for that are not beside the one that names them: share/poise of each
/// folder of $POISE_PATH, then DeployDir.
std::vector<std::filesystem::path> DataFolders();

/// Whether a name may mean a file in a folder named base: one that others are based on, not to be
/// used by itself.
enum class BaseFiles { kRefused, kTaken };

/// The file of a `kind` ("scenarios", "robots", ...) that `name` means, by the one rule for all of
/// them: NAME or NAME.pbtxt beside the file that names it, in `beside` (for a name of the command
/// line: the current folder), then in `kind` of each of DataFolders. A name that ends in .pbtxt
/// means no other ending; an absolute one is looked for only there. A robot's name may be that of
/// its folder, which holds the text. A file that says itself to be of another kind (MessageNamedIn)
/// is meant with its ending alone: a graph may have its scenario's name.
std::optional<std::filesystem::path> LookForFile(const std::string& kind, const std::string& name,
                                                 const std::filesystem::path& beside,
                                                 BaseFiles bases = BaseFiles::kRefused);

/// LookForFile of a file that must be there. Throws ConfigError naming the paths that were
/// searched, and names that are near.
std::filesystem::path FindFile(const std::string& kind, const std::string& name,
                               const std::filesystem::path& beside,
                               BaseFiles bases = BaseFiles::kRefused);

/// FindFile of a name that may be of several kinds: the first kind that has it.
std::filesystem::path FindFileOfKinds(const std::vector<std::string>& kinds,
                                      const std::string& name, const std::filesystem::path& beside);

/// "Graph" where the comments that a file begins with have "proto-message: poise.Graph"; empty:
/// they name none.
std::string MessageNamedIn(const std::filesystem::path& file);

/// Names of the files in `kind` of DataFolders, sorted, those in a folder named base aside.
std::vector<std::string> ListNames(const std::string& kind);

/// The file with one of these names.
std::filesystem::path InstalledFile(const std::string& kind, const std::string& name);

}  // namespace poise
