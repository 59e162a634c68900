// main() of every component's program, and of the one that runs several.
#pragma once

#include "components/framework/component_registry.h"

namespace poise {

/// Runs one component of a run as this process: --run FILE (RunSpec as protobuf text), --component
/// NAME (default: the type's), --state, --standby and --socket (see ProcessRunnerOptions; SIGUSR2
/// takes over), --help, --version. Returns the exit code: 0 after a clean stop (also of a run that
/// failed: health says so), 1 when the bus failed or an output was not finite, 2 for
/// wrong usage or configuration (one line on stderr). Ends with its parent process.
int ComponentMain(int argc, char** argv, const ComponentType& type);

/// ComponentMain of a component that this program's POISE_MODULE adds.
int ModuleComponentMain(int argc, char** argv, const char* type, void (*module)());

/// The program that runs components which share a process.
inline constexpr char kHostProgram[] = "component_host";

/// Runs the components of process --process NAME, whose types `registry` has; else as
/// ComponentMain.
int HostMain(int argc, char** argv, const ComponentRegistry& registry);

}  // namespace poise
