#include "components/framework/optional_outputs.h"

#include <algorithm>

namespace poise {
namespace {

std::vector<OptionalOutput>& All() {
  static std::vector<OptionalOutput> all;
  return all;
}

}  // namespace

void AddOptionalOutput(const OptionalOutput& output) {
  const bool known = std::ranges::any_of(All(), [&](const OptionalOutput& other) {
    return other.component == output.component && other.port == output.port;
  });
  if (!known) All().push_back(output);
}

std::vector<OptionalOutput> OptionalOutputsOf(const std::string& component) {
  std::vector<OptionalOutput> outputs;
  for (const OptionalOutput& output : All()) {
    if (output.component == component) outputs.push_back(output);
  }
  return outputs;
}

}  // namespace poise
