// Component types that are programs in any language, known by what they say of themselves.
#pragma once

#include <string>

#include "components/framework/graph.pb.h"

namespace poise {

/// Makes known the types of lib/poise/components/NAME.json in each folder of POISE_PATH: what
/// `lib/poise/bin/NAME --describe` prints (name, summary, inputs, outputs). Once, after LoadModules
/// and before Components. A file that is no such description is said on stderr and left out.
void LoadDescriptions();

/// Whether the type is one of them: it cannot run in another's process.
bool IsDescribed(const std::string& type);

/// The graph's first component that is one, as an error names it: "component 'task_controller' is
/// springs, a program of its own"; empty: there is none.
std::string OwnProgramOf(const Graph& graph);
/// Throws ConfigError for one that is to share its process with others.
void CheckSharedProcesses(const Graph& graph);

}  // namespace poise
