// The scene of a run beside its messages in an MCAP file.
#pragma once

#include <memory>
#include <string>

#include "logging/export/log_export.h"

namespace poise {

/// The topics of SceneTopics, the maker's file and the scenario as attachments; null, with a
/// warning on the terminal, where the log does not tell its run or robot. Throws LogError.
std::unique_ptr<logging::McapTopics> McapScene(const std::string& log);

}  // namespace poise
