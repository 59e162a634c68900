// Runs a graph inside this process.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/framework/runners/inline_runner.h"
#include "components/framework/runners/run_position.h"
#include "logging/run_record.h"
#include "tools/cli/progress.h"
#include "tools/report/run_outcome.h"

namespace poise {

/// Runs to the end or until a stop signal, with the log in `log_path`; a run in real time is paced
/// with the wall clock. `record`, where given, gets what ReadRun reads of the log, unless the run
/// is so long that it is better read back. Throws ConfigError or LogError.
RunOutcome RunInline(const RunSpec& spec, const std::string& scenario_text,
                     const std::string& log_path, Progress* progress,
                     std::optional<logging::RunRecord>* record = nullptr);

/// Starts this program anew with the same arguments and a library that counts allocations, of which
/// RunInline then tells. Returns where it is there already. Throws ConfigError: there is none.
void CountAllocations();

/// Watches, in a thread of its own, stages that run in this process. Where one does not return for
/// kStallPatience, it says whose that is and ends the program, which nothing else can.
class StageWatch {
 public:
  /// `stages`: by their index in position(). `last_words`, called before the end while the stage
  /// hangs, says what is left of the run; empty: nothing. `spec` outlives the watch.
  StageWatch(const RunSpec& spec, std::vector<InlineRunner::StageName> stages,
             std::function<std::string()> last_words);
  ~StageWatch();
  StageWatch(const StageWatch&) = delete;
  StageWatch& operator=(const StageWatch&) = delete;

  /// Kept by who runs the stages.
  RunPosition* position() { return &position_; }

 private:
  void Run();
  [[noreturn]] void End(int64_t tick, int32_t stage);

  const RunSpec& spec_;
  const std::vector<InlineRunner::StageName> stages_;
  const std::function<std::string()> last_words_;
  RunPosition position_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace poise
