#include "tools/live/live_start.h"

#include <sched.h>
#include <sys/resource.h>

#include <cstdio>
#include <thread>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "logging/log_reader.h"
#include "tools/cli/signals.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

constexpr int kNice = 10;
constexpr std::chrono::milliseconds kLook{4};  // between looks at the log

std::string LogOf(const LiveRun& live) { return (live.dir() / "run.lcm").string(); }

}  // namespace

void StandBack() {
  const sched_param none{};
  if (sched_setscheduler(0, SCHED_BATCH, &none) != 0 || setpriority(PRIO_PROCESS, 0, kNice) != 0) {
    fmt::print(stderr, "warning: this process runs at the run's own priority\n");
  }
}

logging::RunRecord ReadRunStart(const std::string& log) {
  logging::LogReader reader(log);
  logging::RunRecord record;
  record.info = logging::ReadRunInfo(&reader, log, &record.spec);
  record.robot = robot::LoadRobotTexts(record.info.robot, record.info.urdf);
  return record;
}

logging::RunRecord ReadStart(const LiveRun& live, std::chrono::milliseconds patience) {
  const std::string log = LogOf(live);
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (true) {
    try {
      logging::RunRecord record = ReadRunStart(log);
      if (record.spec.run_id() != live.spec().run_id()) {
        throw ConfigError(fmt::format("{}: a new run is starting in this folder; try again",
                                      live.dir().string()));
      }
      return record;
    } catch (const logging::LogError&) {
      if (std::chrono::steady_clock::now() > deadline || !live.InProgress() || StopSignal() != 0) {
        throw;
      }
    }
    std::this_thread::sleep_for(kLook);
  }
}

Scenario ReadScenario(const LiveRun& live, const logging::RunRecord& record) {
  return LoggedScenario(record.info.scenario, LogOf(live) + ": RUN_INFO.scenario");
}

}  // namespace poise
