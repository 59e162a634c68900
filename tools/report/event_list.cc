#include "tools/report/event_list.h"

#include <algorithm>
#include <map>

#include "fmt/format.h"
#include "logging/events/event_spans.h"
#include "tools/cli/lists.h"
#include "tools/cli/text_table.h"
#include "tools/report/fall_story.h"

namespace poise {
namespace {

using logging::Event;
using logging::EventSpan;

constexpr double kTurnGap = 0.1;     // s between two turns of one line
constexpr double kShortTurn = 0.05;  // s; a single one is one line as well
constexpr size_t kWholeList = 60;    // lines of a list that is told whole
constexpr size_t kFirstLines = 25;   // of a longer one
constexpr size_t kLastLines = 15;    // likewise, of a run that did not fall

/// The events with each group of short turns as one.
std::vector<Event> Folded(const std::vector<Event>& events) {
  std::vector<Event> folded = events;
  std::vector<bool> gone(events.size(), false);
  for (const EventSpan& span : logging::EventSpans(events, kTurnGap)) {
    // A search has no end of its own to be folded.
    if (span.name == "searching" || span.name == "no_surface") continue;
    const double length = span.end.value_or(events.back().time) - span.begin;
    if (span.times == 1 && (!span.end || length > kShortTurn)) continue;
    Event& event = folded[span.event];
    if (span.times == 1) {
      event.detail += fmt::format("; for {:.3f} s", length);
    } else {
      event.detail += fmt::format("; {} times {}", span.times,
                                  span.end ? fmt::format("until {:.3f} s", *span.end)
                                           : std::string("and still at the end"));
    }
    for (const size_t other : span.others) gone[other] = true;
  }
  std::vector<Event> kept;
  for (size_t i = 0; i < folded.size(); ++i) {
    if (!gone[i]) kept.push_back(std::move(folded[i]));
  }
  return kept;
}

/// "12 step begins, 12 step lands": how many of each kind, the most frequent first.
std::string Counts(const std::vector<Event>& events, size_t from, size_t to) {
  std::map<std::string, int> counts;
  for (size_t i = from; i < to; ++i) ++counts[events[i].name];
  std::vector<std::pair<std::string, int>> sorted(counts.begin(), counts.end());
  std::ranges::stable_sort(sorted, std::ranges::greater(), &std::pair<std::string, int>::second);
  std::vector<std::string> parts;
  for (const auto& [name, count] : sorted)
    parts.push_back(fmt::format("{} {}", count, Spaced(name)));
  return Joined(parts, ", ");
}

}  // namespace

std::string FormatEvents(const std::vector<Event>& events) {
  if (events.empty()) return "";
  const std::vector<Event> lines = Folded(events);
  size_t hidden_from = lines.size(), hidden_to = lines.size();
  if (lines.size() > kWholeList) {
    hidden_from = kFirstLines;
    hidden_to = lines.size() - kLastLines;
    const auto fall = std::ranges::find(lines, std::string("fall"), &Event::name);
    if (fall != lines.end()) {
      const double since = DecisiveSince(fall->time, events);
      const auto first =
          std::ranges::find_if(lines, [&](const Event& event) { return event.time >= since; });
      hidden_to = std::min(hidden_to, static_cast<size_t>(first - lines.begin()));
    }
    hidden_from = std::min(hidden_from, hidden_to);
  }
  size_t width = 0;
  for (const Event& event : lines) width = std::max(width, event.name.size());
  std::string text = "Events:\n";
  for (size_t i = 0; i < lines.size(); ++i) {
    if (i == hidden_from && hidden_to > hidden_from + 1) {
      text += ScreenLines(6,
                          "  ... {} more lines to {:.3f} s, which the page has (poise "
                          "report): {} ...",
                          hidden_to - hidden_from, lines[hidden_to - 1].time,
                          Counts(lines, hidden_from, hidden_to));
      i = hidden_to;
    }
    text += ScreenLines(static_cast<int>(width) + 15, "  {:7.3f} s  {:<{}}  {}", lines[i].time,
                        Spaced(lines[i].name), width, lines[i].detail);
  }
  return text;
}

}  // namespace poise
