// How loud a run's events are told.
#pragma once

#include <string_view>

namespace poise {

enum class EventLevel { kInfo, kWarning, kError };

/// Returns the level of the events with this name (logging/events/events.h).
EventLevel LevelOfEvent(std::string_view name);

}  // namespace poise
