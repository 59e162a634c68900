// Logs that are made again from what was packed of them.
#pragma once

#include <filesystem>

#include "logging/replay/log_pack.h"
#include "tools/cli/progress.h"

namespace poise {

/// Returns what shows in `line` how far `log` is made again, and stops at a stop signal. `line`
/// outlives it.
logging::OnTick ShowRemake(const std::filesystem::path& log, StatusLine* line);

/// Makes `log` again from run.packed beside it, and says so. Throws LogError.
void MakeLogAgain(const std::filesystem::path& packed, const std::filesystem::path& log);

}  // namespace poise
