#include "tools/run/remake.h"

#include "components/framework/clock.h"
#include "fmt/format.h"
#include "tools/cli/output_place.h"
#include "tools/cli/signals.h"
#include "tools/scenario/registry.h"

namespace poise {

logging::OnTick ShowRemake(const std::filesystem::path& log, StatusLine* line) {
  return
      [name = log.filename().string(), line, start = NowNanoseconds()](int64_t ticks, int64_t of) {
        const double wall = 1e-9 * static_cast<double>(NowNanoseconds() - start);
        if (line->Due(wall)) {
          line->Show(fmt::format("{}: {} of {} ticks made again", name, ticks, of), wall);
        }
        return StopSignal() == 0;
      };
}

void MakeLogAgain(const std::filesystem::path& packed, const std::filesystem::path& log) {
  CatchStopSignals();
  StatusLine line(/*quiet=*/false);
  const logging::PackResult result =
      logging::UnpackLog(packed.string(), log.string(), Components(), ShowRemake(log, &line));
  line.Clear();
  fmt::print(stderr, "{}: made again, {}; poise log pack takes it away again\n", log.string(),
             FormatBytes(static_cast<int64_t>(result.bytes)));
}

}  // namespace poise
