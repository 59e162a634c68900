#include <memory>

#include "components/framework/configuration.h"
#include "deploy/poise/commands.h"
#include "deploy/poise/report.h"
#include "deploy/poise/run_dir.h"
#include "fmt/format.h"

namespace poise {
namespace {

int Report(const std::string& run) {
  const std::string log = FindLog(run).string();
  logging::RunRecord record = logging::ReadRun(log);
  Scenario scenario;
  ParseTextProto(record.info.scenario, log + ": RUN_INFO.scenario", &scenario);
  record.first_tick = FirstCheckedTick(scenario, record);
  const std::vector<CheckResult> checks = EvaluateChecks(scenario, record);
  fmt::print("{} of {}, poise {}\n\n{}\n{}", record.spec.scenario(), record.info.started_at,
             record.spec.poise_version(), FormatTable(checks), FormatAssumptions(scenario));
  for (const CheckResult& check : checks) {
    if (!check.passed) return kExitFailed;
  }
  return kExitOk;
}

}  // namespace

void AddReportCommand(CLI::App* app, Command* command) {
  auto run = std::make_shared<std::string>();
  CLI::App* report = app->add_subcommand("report", "the table of a run from its log");
  report->add_option("run", *run, "folder of a run or a log; default: the latest run");
  report->callback([run, command] { *command = [run] { return Report(*run); }; });
}

}  // namespace poise
