// Events that begin and end something, paired: what lasted from when to when.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "logging/events/events.h"

namespace poise::logging {

/// Something that held, on and off, with interruptions of no more than a gap.
struct EventSpan {
  std::string name;            ///< of the event that begins it
  std::string part;            ///< "right foot", "y"; empty: there is but one
  size_t event = 0;            ///< index of the first event
  double begin = 0;            ///< s
  std::optional<double> end;   ///< s; empty: it held to the list's end
  int times = 1;               ///< how often it set in
  std::vector<size_t> others;  ///< indices of all its other events, ends and begins
};

/// Spans of the events that have an end (contact_lost, balancing_on, ...), by their begin.
/// What is interrupted for up to `gap` s is one span. A foot's search ends as that foot lands.
std::vector<EventSpan> EventSpans(const std::vector<Event>& events, double gap);

/// True for an event that EventSpans pairs with an end.
bool BeginsSpan(std::string_view name);

}  // namespace poise::logging
