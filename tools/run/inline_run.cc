#include "tools/run/inline_run.h"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <utility>
#include <vector>

#include "components/framework/clock.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "components/framework/runners/inline_runner.h"
#include "fmt/format.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/signals.h"
#include "tools/run/stage_watch.h"

namespace poise {
namespace {

using Counter = int64_t (*)();

Counter AllocationCounter() {
  return reinterpret_cast<Counter>(dlsym(RTLD_DEFAULT, "poise_allocations"));
}

void TellAllocations(const InlineRunner& runner) {
  const int64_t ticks = std::max<int64_t>(runner.ticks_completed(), 1);
  fmt::print("allocations in {} ticks, by stage:\n", runner.ticks_completed());
  for (const InlineRunner::StageAllocations& each : runner.allocations()) {
    fmt::print("  {:<44} {}\n", each.component + "." + each.stage,
               each.total == 0
                   ? "none"
                   : fmt::format("{:.1f} a tick, {} at most, in {} ticks",
                                 static_cast<double>(each.total) / static_cast<double>(ticks),
                                 each.most, each.ticks));
  }
}

}  // namespace

void CountAllocations() {
  if (AllocationCounter() != nullptr) return;
  const std::string library = FindProgram("libpoise_allocations.so").string();
  const char* const before = std::getenv("LD_PRELOAD");
  setenv("LD_PRELOAD", (before == nullptr ? library : library + ":" + before).c_str(), 1);
  const std::string line = ReadFile("/proc/self/cmdline");  // arguments end with \0
  std::vector<char*> arguments;
  for (size_t at = 0; at < line.size(); at = line.find('\0', at) + 1) {
    arguments.push_back(const_cast<char*>(line.c_str() + at));
  }
  arguments.push_back(nullptr);
  execv("/proc/self/exe", arguments.data());
  throw ConfigError(fmt::format("--count-allocations: {}", std::strerror(errno)));
}

RunOutcome RunInline(const RunSpec& spec, BoundGraph graph, const run_info_t& info,
                     const std::string& log_path, Progress* progress,
                     std::optional<logging::RunRecord>* record) {
  constexpr int64_t kFlushInterval = 50'000'000;  // ns
  // Ticks whose messages stay in memory, about 6 KB each with 12 joints, so that a run's checks
  // need not read the log back: that took a seventh of a short run.
  constexpr int64_t kMostKept = 30'000;
  InlineRunner runner(spec, std::move(graph));
  const Counter counter = AllocationCounter();
  runner.CountAllocations(counter);
  std::optional<logging::InlineRecord> kept;
  if (record != nullptr && spec.num_ticks() > 0 && spec.num_ticks() <= kMostKept) {
    kept.emplace(spec, info, &runner);
  }
  logging::InlineRecorder recorder(log_path, spec, info, &runner, kept ? &*kept : nullptr);
  RunOutcome outcome;
  std::optional<StageWatch> watch(std::in_place, spec, runner.StageNames(), [&] {
    progress->Clear();
    recorder.Flush();
    return fmt::format("the log has what came before: {}", log_path);
  });
  runner.set_position(watch->position());
  const int64_t start = NowNanoseconds();
  int64_t next_flush = start;
  bool more = true;
  while (more && StopSignal() == 0) {
    const Tick next = MakeTick(runner.ticks_completed(), spec.tick_period(), spec.lead_ticks());
    if (spec.realtime()) {
      const int64_t at = start + 1000 * next.utime;
      const timespec deadline{at / 1'000'000'000, at % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
    }
    more = runner.Step();
    const int64_t now = NowNanoseconds();
    if (now >= next_flush) {
      recorder.Flush();
      next_flush = now + kFlushInterval;
      progress->Show(next.time, static_cast<double>(now - start) * 1e-9);
    }
  }
  watch.reset();
  outcome.wall_time = static_cast<double>(NowNanoseconds() - start) * 1e-9;
  progress->Clear();
  if (counter != nullptr) TellAllocations(runner);
  recorder.Close(spec);
  if (kept) *record = kept->Take(/*latencies=*/true);
  outcome.interrupted = !runner.ended();
  outcome.completed = runner.ended() && !runner.failed();
  outcome.message = outcome.interrupted ? fmt::format("interrupted ({})", sigdescr_np(StopSignal()))
                                        : runner.end_detail();
  return outcome;
}

}  // namespace poise
