// Where results go: nothing is destroyed silently, and a disk that is too small is named.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "components/framework/graph.pb.h"

namespace poise {

/// Refuses a folder that holds anything, and says what, unless `force`. `flag` names what gave it
/// ("--out"). Throws ConfigError.
void CheckFolderFree(const std::string& flag, const std::filesystem::path& folder, bool force);

/// The same for a file; a device or a pipe is always free.
void CheckFileFree(const std::string& flag, const std::filesystem::path& file, bool force);

/// Bytes that the log of a run will take: its messages' sizes and rates. `spec` holds the channels'
/// counts (CheckRun); 0 for a run without a planned end. External messages come on top.
int64_t ExpectedLogSize(const RunSpec& spec);

/// Bytes that may still be written below `folder`, which need not exist yet: by the disk, and to a
/// single file by the shell's limit.
int64_t FreeSpace(const std::filesystem::path& folder);

/// What to say before logs of `bytes` in all are written below `folder`: empty when that is little.
/// Throws ConfigError where they cannot fit, unless `force`.
std::string CheckSpace(const std::filesystem::path& folder, int64_t bytes, bool force);

/// "2.8 MB".
std::string FormatBytes(int64_t bytes);

/// Writes a whole file. Throws ConfigError that names the file and the reason.
void WriteFile(const std::filesystem::path& path, const std::string& text);

}  // namespace poise
