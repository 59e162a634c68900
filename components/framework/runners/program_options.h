// The command line of a small program, as a table. CLI11 is all headers, and whoever includes it
// compiles most of it: here it stands behind one file.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace poise {

struct ProgramOption {
  /// What is told with --NAME, or done by it: then nothing else is asked of the command line, and
  /// the program ends.
  using To = std::variant<std::string*, int*, bool*, std::function<void()>>;

  const char* flag;  ///< "--NAME", or "--NAME,!--no-NAME" of what is on unless it is told
  To to;
  const char* text;  ///< its meaning, for --help
  bool required = false;
  const char* needs = nullptr;  ///< a flag before it in the table, without which it means nothing
};

/// Reads main's arguments, with --help and --version of the program `name`. Gives the exit code
/// where nothing is left to do; what is wrong with the arguments has been told then.
std::optional<int> ParseProgram(int argc, char** argv, const std::string& name,
                                const std::string& description,
                                const std::vector<ProgramOption>& options);

}  // namespace poise
