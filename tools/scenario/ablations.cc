#include "tools/scenario/ablations.h"

#include <algorithm>

#include "tools/cli/lists.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

std::vector<RemovablePart> Parts() {
  std::vector<RemovablePart> parts;
  for (const auto& [type, entry] : Components().entries()) {
    parts.insert(parts.end(), entry.traits.parts.begin(), entry.traits.parts.end());
  }
  return parts;
}

}  // namespace

std::vector<std::string> RemovableParts() {
  std::vector<std::string> names;
  for (const RemovablePart& part : Parts()) names.push_back(part.name);
  return names;
}

std::vector<FieldChange> AblationChanges(const std::vector<std::string>& parts, bool ideal) {
  std::vector<FieldChange> changes;
  for (const RemovablePart& part : Parts()) {
    if (!IsAmong(part.name, parts)) continue;
    changes.push_back({part.field + "=false", "--without " + part.name});
  }
  if (!ideal) return changes;
  for (const auto& [type, entry] : Components().entries()) {
    for (const std::string& set : entry.traits.ideal) {
      const bool known = std::ranges::any_of(changes, [&](const FieldChange& change) {
        return change.set == set;  // of another engine
      });
      if (!known) changes.push_back({set, "--ideal"});
    }
  }
  return changes;
}

std::vector<std::string> Ablation::flags() const {
  std::vector<std::string> flags;
  for (const std::string& part : without) flags.insert(flags.end(), {"--without", part});
  if (ideal) flags.push_back("--ideal");
  return flags;
}

std::vector<Ablation> Ablations() {
  std::vector<Ablation> ablations = {{"full", {}}};
  for (const std::string& part : RemovableParts()) ablations.push_back({"without_" + part, {part}});
  ablations.push_back({"ideal", {}, true});
  return ablations;
}

}  // namespace poise
