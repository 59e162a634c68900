// How loud a run's events are told.
#pragma once

#include <string_view>

namespace poise {

enum class EventLevel { kInfo, kWarning, kError };

/// Of an event's name (logging/metrics/events.h).
EventLevel LevelOfEvent(std::string_view name);

}  // namespace poise
