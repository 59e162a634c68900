#include "components/framework/runners/timing.h"

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

#include "poise/health_t.hpp"

namespace poise {
namespace {

/// MCL_FUTURE under a limit would make later mappings fail: without room to spare only what is
/// there is locked.
bool LockMemory() {
  rlimit limit{};
  const bool free =
      geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  return mlockall(free ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0;
}

bool Pin(int cpu) {
  const long cpus = sysconf(_SC_NPROCESSORS_ONLN);
  if (cpu < 0 && cpus < 2) return false;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(static_cast<size_t>(cpu < 0 ? cpus - 1 : cpu), &set);
  return sched_setaffinity(0, sizeof set, &set) == 0;
}

}  // namespace

Timing TimingOf(const RunSpec& spec, int component) {
  const auto& instances = spec.graph().component();
  const bool owned = std::any_of(instances.begin(), instances.end(),
                                 [](const auto& instance) { return instance.owns_clock(); });
  if (!spec.realtime() || !owned) return Timing::kLockstep;
  const ComponentInstance& instance = instances[component];
  if (instance.owns_clock()) return Timing::kOwner;
  return instance.plant() ? Timing::kPlant : Timing::kFollower;
}

Join JoinOf(Timing timing) {
  if (timing == Timing::kOwner) return Join::kLate;
  return timing == Timing::kFollower ? Join::kNewest : Join::kEvery;
}

int8_t AskForRealtime(const RealtimeOptions& options, Timing timing, int below) {
  int granted = 0;
  if (timing == Timing::kLockstep) return 0;
  if (options.lock_memory() && LockMemory()) granted |= health_t::SCHEDULING_MEMORY_LOCKED;
  if (options.priority() <= 0) return static_cast<int8_t>(granted);
  sched_param parameters{};
  parameters.sched_priority = std::clamp(options.priority() - below, 1, 99);
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) == 0) {
    granted |= health_t::SCHEDULING_FIFO;
    // Without FIFO, pinned processes only stand in each other's way. The simulated robot works
    // beside the controller, as a real one would.
    if (timing != Timing::kPlant && Pin(options.cpu())) granted |= health_t::SCHEDULING_PINNED;
  }
  return static_cast<int8_t>(granted);
}

}  // namespace poise
