// What real time asks of each component, by its place in the graph, and of the system.
#pragma once

#include <cstdint>

#include "components/framework/bus/inbox.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// How a component's ticks are timed.
enum class Timing {
  kLockstep,  ///< every tick; waits for every message, asks again for what is lost
  kOwner,     ///< begins its cycles by the wall clock, runs its stages at their deadlines
  kPlant,     ///< the robot's side: follows the owner's cycles, every one of them
  kFollower,  ///< works on the newest tick that has come, skips what it is too late for
};

/// The timing of a component in the graph: kLockstep of all in lockstep, and in a run in real time
/// whose graph has no owner of the clock.
Timing TimingOf(const RunSpec& spec, int component);

/// Which messages of its inputs a component of this timing takes.
Join JoinOf(Timing timing);

/// Locks memory, sets SCHED_FIFO and pins this process as the run's options ask; what the system
/// refuses is done without. `below`: by how much its priority is less than the owner's. On one core
/// a message then goes on at once if its reader stands above its writer: later in the graph,
/// higher. Returns the granted health_t::SCHEDULING_* bits.
int8_t AskForRealtime(const RealtimeOptions& options, Timing timing, int below);

}  // namespace poise
