// Words of a command that is shown for a shell.
#pragma once

#include <string>

namespace poise {

/// `word` as a POSIX shell reads it back: quoted where that is needed.
inline std::string ShellWord(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n'\"$&|;<>()[]{}*?!#~`\\") == std::string::npos) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace poise
