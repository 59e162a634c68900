#include "logging/events/event_spans.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace poise::logging {
namespace {

struct Pair {
  std::string_view begin;
  std::array<std::string_view, 3> ends;
  bool of_part;  // each foot, or axis, has its own
};

constexpr Pair kPairs[] = {
    {"contact_lost", {"contact_regained"}, true},
    {"balancing_on", {"balancing_off"}, true},
    {"foot_sensor_fault", {"foot_sensor_back"}, true},
    {"eta_infeasible_begins", {"eta_infeasible_ends"}, false},
    {"cop_not_achieved_begins", {"cop_not_achieved_ends"}, false},
    {"step_needed", {"step_needed_ends"}, false},
    {"motor_limited", {"motor_limited_ends"}, true},
    {"motor_hot", {"motor_hot_ends"}, true},
    {"impedance_cut", {"impedance_cut_ends"}, true},
    {"sole_on_edge", {"sole_on_edge_ends"}, true},
    // Nothing says that a search ends but the foot that lands.
    {"searching", {"touch_down", "step_lands", "no_surface"}, true},
    {"no_surface", {"touch_down", "step_lands", "searching"}, true},
};

/// "right foot" of "right foot, which was to carry 29 N", "y" of "y: CoP of ...".
std::string PartOf(const Event& event) {
  constexpr std::string_view kFoot = " foot";
  const size_t foot = event.detail.find(kFoot), end = event.detail.find_first_of(",:;");
  return event.detail.substr(0, foot < end ? foot + kFoot.size() : end);
}

}  // namespace

bool BeginsSpan(std::string_view name) {
  return std::ranges::any_of(kPairs, [&](const Pair& pair) { return pair.begin == name; });
}

std::vector<EventSpan> EventSpans(const std::vector<Event>& events, double gap) {
  std::vector<EventSpan> spans;
  std::map<std::pair<std::string_view, std::string>, size_t> last;
  for (size_t i = 0; i < events.size(); ++i) {
    const Event& event = events[i];
    for (const Pair& pair : kPairs) {
      const std::string part = pair.of_part ? PartOf(event) : "";
      const auto found = last.find({pair.begin, part});
      EventSpan* const span = found == last.end() ? nullptr : &spans[found->second];
      if (event.name == pair.begin) {
        if (span != nullptr && !span->end) continue;  // as of a search that goes on
        if (span != nullptr && event.time - *span->end <= gap) {
          span->end.reset();
          span->others.push_back(i);
          ++span->times;
          continue;
        }
        last[{pair.begin, part}] = spans.size();
        spans.push_back({event.name, part, i, event.time, {}, 1, {}});
      } else if (span != nullptr && !span->end &&
                 std::ranges::find(pair.ends, event.name) != pair.ends.end()) {
        span->end = event.time;
        span->others.push_back(i);
      }
    }
  }
  return spans;
}

}  // namespace poise::logging
