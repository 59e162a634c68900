// How a command ends: exit codes, and what is said of an error.
#pragma once

#include <functional>
#include <string_view>

namespace poise {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailed = 1;  ///< a check or the run failed
inline constexpr int kExitUsage = 2;   ///< wrong usage or configuration
/// In real time: nothing failed but by a machine that was too late, or by an injected fault.
inline constexpr int kExitMachine = 3;

/// Says "poise: PROBLEM" on stderr, after what was printed.
void SayProblem(std::string_view problem);

/// Calls `command`, which gives an exit code. What it throws is said and becomes kExitUsage
/// (ConfigError, RobotError) or kExitFailed; so does output that has not come out, as on a full
/// disk.
int ExitCodeOf(const std::function<int()>& command);

}  // namespace poise
