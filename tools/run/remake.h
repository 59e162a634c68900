// Logs that are made again from what was packed of them.
#pragma once

#include <cstdint>
#include <filesystem>

#include "logging/replay/log_pack.h"
#include "tools/cli/progress.h"

namespace poise {

/// Shows on the terminal how far a log is made again, and stops at a stop signal.
class RemakeProgress {
 public:
  explicit RemakeProgress(const std::filesystem::path& log);
  /// Valid as long as this object.
  logging::OnTick OnTick();
  void Clear() { line_.Clear(); }

 private:
  std::filesystem::path log_;
  int64_t start_;  // ns
  StatusLine line_;
};

/// Makes `log` again from run.packed beside it, and says so. Throws LogError.
void MakeLogAgain(const std::filesystem::path& packed, const std::filesystem::path& log);

}  // namespace poise
