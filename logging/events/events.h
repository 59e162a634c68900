// What happened in a run, in words.
#pragma once

#include <string>
#include <vector>

#include "logging/run_record.h"

namespace poise::logging {

struct Event {
  double time = 0;     ///< s
  std::string name;    ///< stable identifier, "contact_early"
  std::string detail;  ///< for people, with numbers and units
};

/// All of the run, first_tick or not, in order of time, of one tick's events the ends first; found
/// in its messages alone. What holds at the first tick begins there, and what lasts to the run's
/// end has no end. `ended`: false leaves out what messages to come may change (the run's end, the
/// peak of a push under way). A part of a run ends with log_ends. Names: phase_began,
/// support_changed, unloading_begins, unloading_ends, loading_begins, loading_ends, waiting_begins,
/// waiting_ends, searching, touch_down, contact_early, contact_late, no_surface, contact_lost,
/// contact_regained, balancing_on, balancing_off, eta_infeasible_begins, eta_infeasible_ends,
/// cop_not_achieved_begins, cop_not_achieved_ends, step_needed, step_needed_ends, step_begins,
/// step_lands, step_rests, motor_limited, motor_limited_ends, motor_hot, motor_hot_ends,
/// impedance_cut, impedance_cut_ends, sole_on_edge, sole_on_edge_ends, bridge_state, push_begins,
/// push_peak, push_ends, crane_let_go, act_refused (an operator's), fall, run_ended, log_ends.
std::vector<Event> Events(const RunRecord& run, bool ended = true);

}  // namespace poise::logging
