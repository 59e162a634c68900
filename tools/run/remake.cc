#include "tools/run/remake.h"

#include "components/framework/clock.h"
#include "fmt/format.h"
#include "tools/cli/output_place.h"
#include "tools/cli/signals.h"
#include "tools/scenario/registry.h"

namespace poise {

RemakeProgress::RemakeProgress(const std::filesystem::path& log)
    : log_(log), start_(NowNanoseconds()), line_(/*quiet=*/false) {}

logging::OnTick RemakeProgress::OnTick() {
  return [this](int64_t ticks, int64_t of) {
    const double wall = 1e-9 * static_cast<double>(NowNanoseconds() - start_);
    if (line_.Due(wall)) {
      line_.Show(fmt::format("{}: {} of {} ticks made again", log_.filename().string(), ticks, of),
                 wall);
    }
    return StopSignal() == 0;
  };
}

void MakeLogAgain(const std::filesystem::path& packed, const std::filesystem::path& log) {
  CatchStopSignals();
  RemakeProgress progress(log);
  const logging::PackResult result =
      logging::UnpackLog(packed.string(), log.string(), Components(), progress.OnTick());
  progress.Clear();
  fmt::print(stderr, "{}: made again, {}; poise log pack takes it away again\n", log.string(),
             FormatBytes(static_cast<int64_t>(result.bytes)));
}

}  // namespace poise
