// The last words of a program that fails.
#pragma once

#include <cstdio>
#include <string>

namespace poise {

/// Writes `line` to stderr if that can be written. fmt::print throws where a full disk takes
/// nothing more, which would end a catch handler, and with it the program, by SIGABRT.
inline void SayError(const std::string& line) {
  std::fputs((line + "\n").c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace poise
