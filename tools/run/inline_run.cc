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
                     const std::string& log_path, Progress* progress) {
  constexpr int64_t kFlushInterval = 50'000'000;  // ns
  InlineRunner runner(spec, Components());
  logging::InlineRecorder recorder(log_path, spec, scenario_text, &runner);
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
  outcome.interrupted = !runner.ended();
  outcome.completed = runner.ended() && !runner.failed();
  outcome.message = outcome.interrupted ? fmt::format("interrupted ({})", sigdescr_np(StopSignal()))
                                        : runner.end_detail();
  return outcome;
}

}  // namespace poise
