#include "tools/cli/exit_code.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>

#include "components/framework/configuration/configuration.h"
#include "components/framework/say_error.h"
#include "components/robot/robot_model.h"
#include "fmt/format.h"
#include "logging/printable.h"

namespace poise {
namespace {

/// `code`, or failure where what was printed has not come out: a full disk behind a redirection.
int Flushed(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  struct stat out {};
  const bool pipe =
      fstat(STDOUT_FILENO, &out) == 0 && (S_ISFIFO(out.st_mode) || S_ISSOCK(out.st_mode));
  if (pipe) return code;  // its reader has what it wanted
  SayProblem(fmt::format("standard output: cannot be written: {}", std::strerror(errno)));
  return code == kExitOk ? kExitFailed : code;
}

}  // namespace

void SayProblem(std::string_view problem) {
  std::fflush(stdout);
  SayError(fmt::format("poise: {}", logging::LinesForTerminal(problem)));
}

int ExitCodeOf(const std::function<int()>& command) {
  try {
    return Flushed(command());
  } catch (const std::exception& error) {
    SayProblem(error.what());
    const bool usage = dynamic_cast<const ConfigError*>(&error) != nullptr ||
                       dynamic_cast<const robot::RobotError*>(&error) != nullptr;
    return usage ? kExitUsage : kExitFailed;
  }
}

}  // namespace poise
