#include "tools/foxglove/event_level.h"

#include <algorithm>

namespace poise {
namespace {

constexpr std::string_view kErrors[] = {"fall", "no_surface", "contact_lost"};
constexpr std::string_view kWarnings[] = {
    "bridge_state", "step_needed",           "contact_early",
    "contact_late", "eta_infeasible_begins", "cop_not_achieved_begins",
    "act_refused"};

}  // namespace

EventLevel LevelOfEvent(std::string_view name) {
  if (std::ranges::find(kErrors, name) != std::end(kErrors)) return EventLevel::kError;
  if (std::ranges::find(kWarnings, name) != std::end(kWarnings)) return EventLevel::kWarning;
  return EventLevel::kInfo;
}

}  // namespace poise
