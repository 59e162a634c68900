// `poise run` with more than one scenario.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tools/run/scenario_run.h"

namespace poise {

/// The scenario that is run where none is named.
inline constexpr char kFirstScenario[] = "push_double_support";

/// Name that means every scenario with a paper_section.
inline constexpr char kAllScenarios[] = "all";

/// `names` with "all" replaced by the experiments of the paper, in the order of their sections.
/// Throws ConfigError.
std::vector<std::string> ExpandScenarios(const std::vector<std::string>& names);

/// `name`, or with -2, -3, ... at its end when it is taken; then in `taken`.
std::string UniqueName(const std::string& name, std::set<std::string>* taken);

/// Runs one scenario into `out` (empty: a dated folder, where runs/latest then points). Several run
/// one after the other, each in a folder of its own below `out` (MakeRunDir's rules), and an
/// overview follows: verdicts, and the measured figures beside the paper's. runs/latest points to
/// each in turn. One that cannot be run has failed, and the others go on; a stop signal ends the
/// run and the rest. Gives the exit code. Throws as ScenarioRun does; nothing has run then.
int RunScenarios(const std::vector<std::string>& names, const RunOptions& options,
                 const std::string& out);

}  // namespace poise
