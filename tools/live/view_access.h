// Who may read and who may act: the checks of a request to the page of a run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace poise {

/// A request's target, "/PATH?KEY=VALUE&...". Other keys are passed over.
struct ViewTarget {
  std::string_view path;
  std::string_view token;  ///< empty: none
  int64_t from = 0;        ///< the tick that a client wants first
  int64_t before = 0;      ///< the tick up to which it wants earlier ones
};
/// None when it is malformed.
std::optional<ViewTarget> ReadTarget(std::string_view target);

/// 128 random bits from the system, in hexadecimal digits. Throws std::system_error.
std::string MakeToken();
/// Compares in a time that tells nothing of where they differ.
bool SameToken(std::string_view given, std::string_view token);

}  // namespace poise
