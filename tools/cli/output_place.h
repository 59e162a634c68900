// Where results go: nothing is destroyed silently, and a disk that is too small is named.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "components/framework/graph.pb.h"

namespace poise {

/// Refuses a folder that holds anything, and says what, unless `force`. `flag` names what gave it
/// ("--out"). Throws ConfigError.
void CheckFolderFree(const std::string& flag, const std::filesystem::path& folder, bool force);

/// Makes the folder of --out where it is not there; its absolute path. Throws ConfigError.
std::filesystem::path MakeOutFolder(const std::string& out);

/// CheckFolderFree for a file, which must be one that can be written; a device or a pipe is always
/// free. Logs are left to who writes: nothing replaces one (PartialFile).
void CheckFileFree(const std::string& flag, const std::filesystem::path& file, bool force);

/// Bytes that the log of a run will take: its messages' sizes and rates. `spec` holds the channels'
/// counts (CheckRun); 0 for a run without a planned end. External messages come on top.
int64_t ExpectedLogSize(const RunSpec& spec);

/// Logs that are about to be written.
struct LogSizes {
  int64_t sum = 0;      ///< bytes
  int64_t largest = 0;  ///< bytes of one
  void Add(int64_t size) { Add({size, size}); }
  void Add(const LogSizes& more) {
    sum += more.sum;
    largest = std::max(largest, more.largest);
  }
};

/// What to say before `logs` are written below `folder`, which need not exist yet: empty when they
/// take little of what is free. Throws ConfigError where the disk, or the limit on a file's size,
/// cannot hold them, unless `force`.
std::string CheckSpace(const std::filesystem::path& folder, const LogSizes& logs, bool force);

/// "2.8 MB".
std::string FormatBytes(int64_t bytes);

/// Writes a whole file. Throws ConfigError that names the file and the reason.
void WriteFile(const std::filesystem::path& path, const std::string& text);

/// Writes all of `text`; false: it cannot be.
bool WriteAll(int fd, std::string_view text);

}  // namespace poise
