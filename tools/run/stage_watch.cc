#include "tools/run/stage_watch.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/stall_watch.h"

namespace poise {
namespace {

StageWatch* present = nullptr;  // exit() gives its handlers no way to know whose they are

}  // namespace

StageWatch::StageWatch(const RunSpec& spec, std::vector<InlineRunner::StageName> stages,
                       std::function<std::string()> last_words)
    : spec_(spec), stages_(std::move(stages)), last_words_(std::move(last_words)) {
  [[maybe_unused]] static const int once = on_exit(&StageWatch::OnExit, nullptr);
  present = this;
  const auto progress = [this]() -> int64_t {
    const int32_t stage = position_.stage.load(std::memory_order_relaxed);
    const int64_t tick = position_.tick.load(std::memory_order_relaxed);
    // Between the stages the run writes its log: to wait for the disk there is no stall.
    if (stage == RunPosition::kNoStage) return -1;
    return tick * static_cast<int64_t>(stages_.size()) + stage;
  };
  const auto stalled = [this](int64_t at) {
    const auto stages = static_cast<int64_t>(stages_.size());
    End(at / stages, static_cast<int32_t>(at % stages), "hangs",
        fmt::format("has not returned for {} s", kStallPatience / 1'000'000'000));
  };
  thread_ = WatchForStall(kStallPatience, progress, stalled);
}

StageWatch::~StageWatch() { present = nullptr; }

void StageWatch::OnExit(int code, void* /*unused*/) {
  if (present == nullptr) return;
  const int32_t stage = present->position_.stage.load();
  if (stage == RunPosition::kNoStage) return;
  present->End(present->position_.tick.load(), stage, "ends the run",
               fmt::format("called exit({})", code));
}

void StageWatch::End(int64_t tick, int32_t stage, const std::string& what, const std::string& did) {
  std::string rest;
  try {
    rest = last_words_();
  } catch (const std::exception& error) {
    rest = error.what();
  }
  const InlineRunner::StageName& name = stages_[static_cast<size_t>(stage)];
  fmt::print(stderr, "poise: {} {}: its stage {} {}, at tick {} ({:.3f} s){}{}\n", name.component,
             what, name.stage, did, tick,
             MakeTick(tick, spec_.tick_period(), spec_.lead_ticks()).time, rest.empty() ? "" : "; ",
             rest);
  std::fflush(nullptr);
  _exit(1);
}

}  // namespace poise
