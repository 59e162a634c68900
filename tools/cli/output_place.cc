#include "tools/cli/output_place.h"

#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/log_reader.h"
#include "poise/message_traits.hpp"

namespace poise {
namespace {

namespace fs = std::filesystem;

// RUN_INFO and the processes' health come on top of the channels.
constexpr double kBesides = 1.02;
constexpr int64_t kRunInfo = 50'000;       // bytes
constexpr int64_t kLarge = 1'000'000'000;  // bytes; or
constexpr int kLargeShare = 10;            // a tenth of what is free: worth a word

/// What a folder holds, in words.
std::string Holdings(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "run.lcm", error) || fs::exists(folder / "run_spec.pbtxt", error)) {
    return "holds a run";
  }
  if (fs::exists(folder / "results.jsonl", error)) return "holds a sweep's results.jsonl";
  if (fs::exists(folder / "matrix.csv", error)) return "holds a matrix";
  return "is not empty";
}

/// Bytes that may still be written below `folder`.
int64_t FreeSpace(const fs::path& folder) {
  fs::path existing = fs::absolute(folder);
  std::error_code error;
  while (!fs::exists(existing, error) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  struct statvfs disk {};
  if (statvfs(existing.c_str(), &disk) != 0) return INT64_MAX;
  return static_cast<int64_t>(disk.f_bavail) * static_cast<int64_t>(disk.f_frsize);
}

}  // namespace

void CheckFolderFree(const std::string& flag, const fs::path& folder, bool force) {
  std::error_code error;
  if (force || !fs::is_directory(folder, error)) return;
  if (fs::directory_iterator(folder, error) == fs::directory_iterator() && !error) return;
  if (error) {
    throw ConfigError(
        fmt::format("{} {}: cannot be read: {}", flag, folder.string(), error.message()));
  }
  throw ConfigError(
      fmt::format("{} {}: {}; choose another folder, or replace what is there with --force", flag,
                  folder.string(), Holdings(folder)));
}

fs::path MakeOutFolder(const std::string& out) {
  const fs::path folder = fs::absolute(out);
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && fs::is_directory(folder)) return folder;
  throw ConfigError(fmt::format("--out {}: cannot be made: {}", out,
                                error ? error.message() : "there is a file of that name"));
}

void CheckFileFree(const std::string& flag, const fs::path& file, bool force) {
  std::error_code error;
  const fs::path folder = fs::absolute(file).parent_path() / "";
  if (access(fs::exists(file, error) ? file.c_str() : folder.c_str(), W_OK) != 0) {
    throw ConfigError(
        fmt::format("{} {}: cannot be written: {}", flag, file.string(), std::strerror(errno)));
  }
  if (force || !fs::is_regular_file(file, error) || logging::IsEventLog(file.string())) return;
  throw ConfigError(fmt::format("{} {}: exists; choose another name, or replace it with --force",
                                flag, file.string()));
}

int64_t ExpectedLogSize(const RunSpec& spec) {
  int64_t tick = 0;
  for (const Channel& channel : spec.graph().channel()) {
    const MessageType* const type = FindMessageType(channel.type());
    if (channel.external() || type == nullptr) continue;
    tick += static_cast<int64_t>(logging::kEventLogHeader + channel.name().size()) +
            type->encoded_size(CountsOf(channel));
  }
  const double channels = static_cast<double>(tick) * static_cast<double>(spec.num_ticks());
  return spec.num_ticks() == 0 ? 0 : kRunInfo + static_cast<int64_t>(kBesides * channels);
}

std::string CheckSpace(const fs::path& folder, const LogSizes& logs, bool force) {
  const auto refuse = [&](const std::string& why) {
    if (force) return;
    throw ConfigError(fmt::format(
        "{}; choose another folder (--out) or a shorter run (--duration), or start all the same "
        "with --force",
        why));
  };
  const int64_t free = FreeSpace(folder);
  const std::string take = fmt::format("the log will take about {}", FormatBytes(logs.sum));
  const std::string there = fmt::format("{} are free in {}", FormatBytes(free), folder.string());
  if (logs.sum > free) refuse(fmt::format("{}; only {}", take, there));
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < static_cast<rlim_t>(logs.largest)) {
    refuse(fmt::format("{}; the shell's limit on a file's size is {} (ulimit -f)", take,
                       FormatBytes(static_cast<int64_t>(limit.rlim_cur))));
  }
  const bool little = logs.sum <= std::min(kLarge, free / kLargeShare);
  return little ? "" : fmt::format("{}; {}", take, there);
}

std::string FormatBytes(int64_t bytes) {
  const auto size = static_cast<double>(bytes);
  if (bytes < 10'000) return fmt::format("{} B", bytes);
  if (bytes < 1'000'000) return fmt::format("{:.1f} kB", size * 1e-3);
  if (bytes < 1'000'000'000) return fmt::format("{:.1f} MB", size * 1e-6);
  return fmt::format("{:.1f} GB", size * 1e-9);
}

void WriteFile(const fs::path& path, const std::string& text) {
  errno = 0;
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (out.flush()) return;
  const std::string why = errno != 0 ? std::strerror(errno) : "unknown reason";
  // What a full disk leaves of a file would stand in the way of the next try.
  if (std::error_code error; out.is_open() && fs::is_regular_file(path, error)) {
    fs::remove(path, error);
  }
  throw ConfigError(fmt::format("{}: cannot be written: {}", path.string(), why));
}

bool WriteAll(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<size_t>(written));
  }
  return true;
}

}  // namespace poise
