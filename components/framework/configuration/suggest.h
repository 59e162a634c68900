// What an author may have meant by a name that does not exist.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// Up to three of `names` that `name` may have meant, nearest first.
std::vector<std::string> Nearest(std::string_view name, std::vector<std::string> names);

/// "did you mean x or y?": up to three of `names`, nearest first; "use one of ..." with all of them
/// when none is near.
std::string Suggest(std::string_view name, std::vector<std::string> names);

}  // namespace poise
