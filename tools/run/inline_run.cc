#include "tools/run/inline_run.h"

#include <cstring>
#include <ctime>

#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "components/framework/runners/inline_runner.h"
#include "fmt/format.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/signals.h"
#include "tools/scenario/registry.h"

namespace poise {

RunOutcome RunInline(const RunSpec& spec, const std::string& scenario_text,
                     const std::string& log_path, Progress* progress,
                     std::optional<logging::RunRecord>* record) {
  constexpr int64_t kFlushInterval = 50'000'000;  // ns
  // Ticks whose messages stay in memory, about 6 KB each with 12 joints, so that a run's checks
  // need not read the log back: that took a seventh of a short run.
  constexpr int64_t kMostKept = 30'000;
  InlineRunner runner(spec, Components());
  const run_info_t info = logging::MakeRunInfo(spec, scenario_text);
  std::optional<logging::InlineRecord> kept;
  if (record != nullptr && spec.num_ticks() > 0 && spec.num_ticks() <= kMostKept) {
    kept.emplace(spec, info, &runner);
  }
  logging::InlineRecorder recorder(log_path, spec, info, &runner, kept ? &*kept : nullptr);
  RunOutcome outcome;
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
  outcome.wall_time = static_cast<double>(NowNanoseconds() - start) * 1e-9;
  progress->Clear();
  recorder.Close(spec);
  if (kept) *record = kept->Take(/*latencies=*/true);
  outcome.interrupted = !runner.ended();
  outcome.completed = runner.ended() && !runner.failed();
  outcome.message = outcome.interrupted ? fmt::format("interrupted ({})", sigdescr_np(StopSignal()))
                                        : runner.end_detail();
  return outcome;
}

}  // namespace poise
