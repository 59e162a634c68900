// How loud a run's events are told.
#pragma once

#include <string_view>

#include "tools/cli/lists.h"

namespace poise {

enum class EventLevel { kInfo, kWarning, kError };

/// Returns the level of the events with this name (logging/events/events.h).
inline EventLevel LevelOfEvent(std::string_view name) {
  constexpr std::string_view kErrors[] = {"fall", "no_surface", "contact_lost"};
  constexpr std::string_view kWarnings[] = {
      "bridge_state", "step_needed",           "contact_early",
      "contact_late", "eta_infeasible_begins", "cop_not_achieved_begins",
      "act_refused"};
  if (IsAmong(name, kErrors)) return EventLevel::kError;
  return IsAmong(name, kWarnings) ? EventLevel::kWarning : EventLevel::kInfo;
}

}  // namespace poise
