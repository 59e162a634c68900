// Names the stage that keeps this program, or ends it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/framework/runners/inline_runner.h"
#include "components/framework/runners/run_position.h"

namespace poise {

/// Watches stages that run in this process. Where one does not return for kStallPatience, it says
/// whose that is and ends the program, which nothing else can; where one calls exit(), it says so,
/// and the program fails whatever the code was. One at a time.
class StageWatch {
 public:
  /// `stages`: by their index in position(). `last_words`, called before the end while the stage
  /// has not returned, says what is left of the run; empty: nothing. `spec` outlives the watch.
  StageWatch(const RunSpec& spec, std::vector<InlineRunner::StageName> stages,
             std::function<std::string()> last_words);
  ~StageWatch();
  StageWatch(const StageWatch&) = delete;
  StageWatch& operator=(const StageWatch&) = delete;

  /// Kept by who runs the stages.
  RunPosition* position() { return &position_; }

 private:
  static void OnExit(int code, void* unused);
  [[noreturn]] void End(int64_t tick, int32_t stage, const std::string& what,
                        const std::string& did);

  const RunSpec& spec_;
  const std::vector<InlineRunner::StageName> stages_;
  const std::function<std::string()> last_words_;
  RunPosition position_;
  std::jthread thread_;
};

}  // namespace poise
