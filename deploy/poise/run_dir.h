// The folder that a run leaves.
#pragma once

#include <filesystem>
#include <string>

#include "components/framework/graph.pb.h"

namespace poise {

/// runs/ beside deploy/.
std::filesystem::path RunsDir();

/// Makes the run's folder: `out`, from which an earlier run's files are removed, or, when empty, a
/// new one under runs/ named after date and `name`, to which runs/latest then points. Throws
/// ConfigError.
std::filesystem::path MakeRunDir(const std::string& out, const std::string& name);

/// In a run's folder, the folder of the run that it is compared with.
std::filesystem::path ReferenceDir(const std::filesystem::path& dir);

/// Lets runs/latest point to `dir`, a folder below runs/; does nothing for one elsewhere.
void PointLatestTo(const std::filesystem::path& dir);

/// The log that `run` means: a folder of a run, a log, or, when empty, the latest run under runs/.
/// Throws ConfigError.
std::filesystem::path FindLog(const std::string& run);

/// The run spec in a run's folder (FindLog's rules). Throws ConfigError.
RunSpec ReadRunSpec(const std::string& run);

/// Writes a whole file. Throws ConfigError.
void WriteFile(const std::filesystem::path& path, const std::string& text);

}  // namespace poise
