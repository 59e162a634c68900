#include "tools/report/fall_story.h"

#include <algorithm>
#include <cmath>

#include "fmt/format.h"
#include "logging/events/event_spans.h"
#include "logging/metrics/contact_history.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

using logging::Event;
using logging::EventSpan;

constexpr double kSameTrouble = 0.5;    // s; what sets in again sooner had not ended
constexpr double kLastSeconds = 3;      // s before the fall; what ended earlier is not told
constexpr double kLedTo = 1;            // s before the first that did not end
constexpr size_t kMostTroubles = 5;     // told at most
constexpr double kBalanced = 0.2;       // s, of balancing that is worth telling
constexpr double kBalancingGap = 0.02;  // s, of an interruption of it

struct TroubleWords {
  std::string_view name;
  std::string_view words;  // {} stands for the event's detail
};

constexpr TroubleWords kTrouble[] = {
    {"contact_early", "contact came early ({})"},
    {"contact_late", "contact came late ({})"},
    {"searching", "a foot searched for the ground ({})"},
    {"no_surface", "a foot found no ground ({})"},
    {"contact_lost", "contact was lost ({})"},
    {"foot_sensor_fault", "a foot's sensor was not believed ({})"},
    {"eta_infeasible_begins", "no distribution between the feet met all conditions"},
    {"cop_not_achieved_begins", "the centre of pressure could not be kept in its limits"},
    {"step_needed",
     "the capture point was outside the soles, which only another step could answer"},
    {"motor_limited", "a motor was at its largest torque ({})"},
    {"motor_hot", "a motor was too hot for more than its rated current ({})"},
    {"impedance_cut", "a drive's impedance was cut ({})"},
    {"sole_on_edge", "a foot stood on the edge of its sole ({})"},
    {"bridge_state", "the bridge went from {}"},
};

const TroubleWords* FindTrouble(std::string_view name) {
  const auto found = std::ranges::find(kTrouble, name, &TroubleWords::name);
  return found == std::end(kTrouble) ? nullptr : found;
}

std::string Told(const Trouble& trouble) {
  return fmt::format(fmt::runtime(FindTrouble(trouble.name)->words), trouble.detail);
}

/// All before the fall, by their begin.
std::vector<Trouble> All(double fall, const std::vector<Event>& events) {
  std::vector<Event> before;
  std::ranges::copy_if(events, std::back_inserter(before),
                       [&](const Event& event) { return event.time <= fall; });
  std::vector<Trouble> all;
  for (const EventSpan& span : logging::EventSpans(before, kSameTrouble)) {
    if (FindTrouble(span.name) == nullptr) continue;
    std::optional<double> end = span.end;
    if (end && fall - *end <= kSameTrouble) end.reset();  // the fall ended it
    all.push_back({span.name, before[span.event].detail, span.begin, end});
  }
  for (size_t i = 0; i < before.size(); ++i) {
    const Event& event = before[i];
    if (FindTrouble(event.name) == nullptr || logging::BeginsSpan(event.name)) continue;
    Trouble trouble{event.name, event.detail, event.time, event.time};
    if (event.name == "bridge_state") {
      // At its start the bridge comes to follow, and one stop goes through several states.
      if (!event.detail.starts_with("running")) continue;
      trouble.end.reset();
      for (size_t k = i + 1; k < before.size() && !trouble.end; ++k) {
        const bool again = before[k].name == "bridge_state" &&
                           before[k].detail.find(" to running") != std::string::npos;
        if (again) trouble.end = before[k].time;
      }
    }
    all.push_back(trouble);
  }
  std::ranges::stable_sort(all, {}, &Trouble::begin);
  return all;
}

/// ", while the right foot was on its way": what the planner's own step did then.
std::string Meanwhile(const logging::RunRecord& run, double time) {
  const int64_t tick = std::llround(time / run.spec.tick_period()) + run.spec.lead_ticks();
  const planner_status_t* const planner = run.planner.at(tick);
  if (planner == nullptr || planner->step_foot < 0 || planner->step_foot >= planner->num_feet)
    return "";
  const std::string foot = logging::FootName(run, static_cast<size_t>(planner->step_foot));
  switch (planner->stepping) {
    case planner_status_t::STEPPING_UNLOADING:
      return fmt::format(", while the {} was being unloaded for a step,", foot);
    case planner_status_t::STEPPING_SWINGING:
      return fmt::format(", while the {} was on its way,", foot);
    case planner_status_t::STEPPING_LOADING:
      return fmt::format(", while the {} was being loaded after its step,", foot);
    default:
      return "";
  }
}

/// "; balancing (y) was on since 41.612 s": at its limit before anything else went wrong.
std::string Balanced(double time, const std::vector<Event>& events) {
  std::vector<std::string> axes;
  double since = time;
  for (const EventSpan& span : logging::EventSpans(events, kBalancingGap)) {
    if (span.name != "balancing_on" || span.begin > time - kBalanced) continue;
    if (span.end && *span.end < time) continue;
    axes.push_back(span.part);
    since = std::min(since, span.begin);
  }
  if (axes.empty()) return "";
  return fmt::format(" Balancing ({}) had been on since {:.3f} s.", Joined(axes, " and "), since);
}

}  // namespace

bool IsTrouble(std::string_view event) { return FindTrouble(event) != nullptr; }

std::vector<Trouble> TroublesBefore(double fall, const std::vector<Event>& events) {
  const std::vector<Trouble> all = All(fall, events);
  double since = fall - kLastSeconds;
  const auto open = [](const Trouble& trouble) { return !trouble.end; };
  if (const auto first = std::ranges::find_if(all, open); first != all.end()) {
    since = std::max(since, first->begin - kLedTo);
  }
  std::vector<Trouble> told;
  // What did not end comes first: where there is too much, the rest is left out. But what a motor
  // could not give while it stood may be why, and what it cannot give in the fall is not.
  for (const bool lasting : {true, false}) {
    for (const Trouble& trouble : all) {
      if (open(trouble) != lasting) continue;
      if (!lasting && *trouble.end < since) continue;
      const auto same = std::ranges::find(told, trouble.name, &Trouble::name);
      if (same != told.end() && trouble.begin < same->begin && trouble.name.starts_with("motor_")) {
        *same = trouble;
        continue;
      }
      if (told.size() == kMostTroubles) continue;
      if (same == told.end() || (lasting && trouble.name == "contact_lost")) {
        told.push_back(trouble);
      }
    }
  }
  std::ranges::stable_sort(told, {}, &Trouble::begin);
  return told;
}

namespace {

/// "; for the first time at 1.840 s", of a motor that had come to its limit before.
std::string FirstTime(const Trouble& trouble, const std::vector<Event>& events) {
  const auto first = std::ranges::find(events, trouble.name, &Event::name);
  const bool before = trouble.name.starts_with("motor_") && first != events.end() &&
                      first->time < trouble.begin - kSameTrouble;
  return before ? fmt::format(", a motor for the first time at {:.3f} s", first->time) : "";
}

}  // namespace

std::string TellFall(const logging::RunRecord& run, double fall, const std::vector<Event>& events) {
  const std::vector<Trouble> troubles = TroublesBefore(fall, events);
  if (troubles.empty()) {
    return fmt::format("Nothing else went wrong {}before it fell.",
                       fall > kLastSeconds ? fmt::format("in the {} s ", kLastSeconds) : "");
  }
  std::vector<std::string> parts;
  for (const Trouble& trouble : troubles) {
    const std::string meanwhile =
        &trouble == &troubles.front() ? Meanwhile(run, trouble.begin) : "";
    const bool moment = trouble.end && *trouble.end == trouble.begin;
    parts.push_back(fmt::format(
        "at {:.3f} s{} {}{}{}", trouble.begin, meanwhile, Told(trouble),
        trouble.end && !moment ? fmt::format(", for {:.3f} s", *trouble.end - trouble.begin) : "",
        FirstTime(trouble, events)));
  }
  return fmt::format("Before it fell: {}.{}", Joined(parts, "; "),
                     Balanced(troubles.front().begin, events));
}

double DecisiveSince(double fall, const std::vector<Event>& events) {
  const std::vector<Trouble> troubles = TroublesBefore(fall, events);
  double since = fall - kLastSeconds;
  // What began much earlier and did not end is in the list's summary.
  for (const Trouble& trouble : troubles) {
    if (trouble.begin > fall - 2 * kLastSeconds) since = std::min(since, trouble.begin - kLedTo);
  }
  return since;
}

}  // namespace poise
