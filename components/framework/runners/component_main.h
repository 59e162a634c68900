// main() of every component's program.
#pragma once

#include <string>

#include "components/framework/component_type.h"

namespace poise {

/// Runs one component of a run as this process: --run FILE (RunSpec as protobuf text), --component
/// NAME (default: the type's), --state and --standby (see ProcessRunnerOptions; SIGUSR2 takes
/// over),
/// --help, --version. Returns the exit code: 0 after a clean stop (also of a run that
/// failed: health says so), 1 when the bus failed or an output was not finite, 2 for
/// wrong usage or configuration (one line on stderr). Ends with its parent process.
int ComponentMain(int argc, char** argv, const ComponentType& type);

}  // namespace poise
