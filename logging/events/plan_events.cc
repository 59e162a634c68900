#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "fmt/format.h"
#include "logging/events/event_groups.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/schedule_plan.h"

namespace poise::logging {
namespace {

/// What the phase before came to, where that is not its planned end; else empty.
std::string OutcomeText(int8_t outcome) {
  switch (outcome) {
    case planner_status_t::OUTCOME_NO_SURFACE:
      return ": no surface was found";
    case planner_status_t::OUTCOME_CONTACT_LOST:
      return ": a contact was lost";
    case planner_status_t::OUTCOME_TIMEOUT:
      return ": the phase before had waited for too long";
    default:
      return "";
  }
}

void AddPhases(const RunRecord& run, EventList* events) {
  const auto schedule = ReadSchedulePlan(run);
  std::optional<int32_t> phase;
  double last_time = 0;
  for (const auto& [tick, planner] : Messages(run.planner, 0, run.num_ticks)) {
    // A phase may follow itself: then its time begins anew.
    const bool began = planner->phase != phase || planner->phase_time < last_time;
    last_time = planner->phase_time;
    if (!began) continue;
    phase = planner->phase;
    const auto i = static_cast<size_t>(*phase);
    const bool named = schedule && i < schedule->size() && !(*schedule)[i].name.empty();
    events->Add(tick, "phase_began",
                (named ? fmt::format("phase {}, {}", *phase, (*schedule)[i].name)
                       : fmt::format("phase {}", *phase)) +
                    OutcomeText(planner->began_by));
  }
}

void AddSupport(const RunRecord& run, EventList* events) {
  for (const SupportChange& change : SupportChanges(run)) {
    events->Add(change.tick, "support_changed",
                fmt::format("{} to {}; largest torque step {:.3g} N·m in {}",
                            SupportName(run, change.before), SupportName(run, change.after),
                            change.torque_step, run.robot.joints()[change.joint].name));
  }
}

void AddHandovers(const RunRecord& run, EventList* events) {
  for (const auto& [kind, begin, end] :
       {std::tuple{support_plan_t::TRANSITION_UNLOADING, "unloading_begins", "unloading_ends"},
        std::tuple{support_plan_t::TRANSITION_LOADING, "loading_begins", "loading_ends"}}) {
    for (size_t foot = 0; foot < 2; ++foot) {
      const auto holds = OfTick(run.plan, [&, wanted = kind](const support_plan_t& plan) {
        return plan.transition == wanted && plan.transition_foot == static_cast<int>(foot);
      });
      events->AddIntervals(Intervals(run, holds), begin, end,
                           [&](int64_t) { return FootName(run, foot); });
    }
  }
}

void AddWaiting(const RunRecord& run, EventList* events) {
  for (const auto& [reason, text] :
       {std::pair{planner_status_t::WAITING_COM, "for the COM to come above the stance sole"},
        std::pair{planner_status_t::WAITING_CONTACT,
                  "for the measured load to confirm the contact"},
        std::pair{planner_status_t::WAITING_NO_SURFACE, "no surface was found"}}) {
    const auto holds = OfTick(run.planner, [&, wanted = reason](const planner_status_t& planner) {
      return planner.waiting_for == wanted;
    });
    events->AddIntervals(Intervals(run, holds), "waiting_begins", "waiting_ends",
                         [&, why = text](int64_t) { return std::string(why); });
  }
}

}  // namespace

void AddPlanEvents(const RunRecord& run, EventList* events) {
  AddPhases(run, events);
  AddSupport(run, events);
  AddHandovers(run, events);
  AddWaiting(run, events);
}

}  // namespace poise::logging
