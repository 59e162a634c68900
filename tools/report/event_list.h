// The events of a run as lines.
#pragma once

#include <string>
#include <vector>

#include "logging/events/events.h"

namespace poise {

/// A line each, in order; what goes on and off in short turns is one line with their count. Of a
/// long list the first ones, how many of each kind follow, and the last ones: of a run that fell
/// all of the last seconds, from what led to the fall on.
std::string FormatEvents(const std::vector<logging::Event>& events);

}  // namespace poise
