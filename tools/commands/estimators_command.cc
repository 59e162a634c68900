// `poise estimators`: every estimator beside the truth, on the readings of a run.
#include <cmath>
#include <memory>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/log_reader.h"
#include "logging/metrics/metrics.h"
#include "tools/cli/cli_checks.h"
#include "tools/cli/text_table.h"
#include "tools/commands/commands.h"
#include "tools/run/estimates.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

struct EstimatorsOptions {
  std::vector<std::string> runs;
  std::vector<std::string> set;
  double from = 0;
};

struct Column {
  const char* heading;
  const char* metric;  // without its prefix
};
constexpr Column kColumns[] = {
    {"position RMS", "position_rms"}, {"worst", "position_max"},
    {"velocity RMS", "velocity_rms"}, {"worst", "velocity_max"},
    {"tilt RMS", "tilt_rms"},         {"worst", "tilt_max"},
    {"NEES in 95 %", "nees_share"},   {"tilt, velocity", "nees_observable_share"},
};

struct Method {
  int method;
  const char* name;
  const char* prefix;  // of its metrics
};
constexpr Method kMethods[] = {
    {estimator_status_t::METHOD_ANCHORED_FEET, "ANCHORED_FEET", "anchored_feet"},
    {estimator_status_t::METHOD_INVARIANT_EKF, "INVARIANT_EKF", "invariant_ekf"},
};

int CompareEstimators(const EstimatorsOptions& options) {
  std::vector<TableRow> rows(1);
  rows[0] = {"run", "method"};
  for (const Column& column : kColumns) rows[0].push_back(column.heading);
  rows[0].push_back("a tick");
  std::vector<std::string> runs = options.runs;
  if (runs.empty()) runs.push_back("");
  for (const std::string& name : runs) {
    const std::string log = FindLog(name).string();
    logging::RunRecord run = logging::ReadRun(log);
    run.first_tick = std::llround(options.from / run.spec.tick_period()) + run.spec.lead_ticks();
    if (run.truth.empty()) {
      throw logging::LogError(fmt::format(
          "{}: holds no GROUND_TRUTH to compare with: it is not the log of a simulation", log));
    }
    if (run.first_tick >= run.num_ticks) {
      throw ConfigError(
          fmt::format("--from {}: {} ends at {} s", options.from, log, run.time(run.num_ticks)));
    }
    if (!EstimatorOf(run.spec)) {
      throw logging::LogError(fmt::format("{}: its graph has no state estimator", log));
    }
    if (run.sensors.empty()) {
      throw logging::LogError(fmt::format("{}: holds no ROBOT_SENSORS to estimate from", log));
    }
    RunSpec spec = run.spec;
    ChangeConfigurations(options.set, &spec);
    // Both methods run again, also the one that ran: the configuration may be another.
    run.estimator = {};
    for (const auto& [method, name_of_method, prefix] : kMethods) {
      Reestimated result = Reestimate(spec, method, run);
      run.other_estimates[static_cast<size_t>(method)] = std::move(result.estimates);
      rows.push_back({method == 0 ? run.spec.scenario() : "", name_of_method});
      for (const Column& column : kColumns) {
        const logging::Metric* metric =
            logging::FindMetric(fmt::format("{}_{}", prefix, column.metric));
        const logging::Answer value = metric ? metric->compute(run) : logging::Answer();
        rows.back().push_back(value ? FormatNumber(*value, metric->unit) : "-");
      }
      rows.back().push_back(FormatNumber(result.tick_time, "µs"));
    }
  }
  fmt::print("{}", FormatColumns(rows));
  return kExitOk;
}

}  // namespace

void AddEstimatorsCommand(CLI::App* app, Command* command) {
  auto options = std::make_shared<EstimatorsOptions>();
  CLI::App* estimators = app->add_subcommand(
      "estimators",
      "run every method of the state estimator over a run's readings, beside the true state");
  estimators->footer(
      "NEES: the squared error over the covariance that the method publishes. The table gives the "
      "share of ticks below what a right covariance gives for 0.95, for orientation, velocity and "
      "position (9 numbers), and for tilt and velocity alone (5). Position and heading cannot be "
      "observed; their covariance grows.");
  estimators->add_option("run", options->runs, "folders of runs or logs; default: the latest run");
  estimators
      ->add_option("--set", options->set,
                   "change a field of a configuration (poise list fields), e.g. --set "
                   "state_estimator.invariant_ekf.contact_walk=1e-3")
      ->type_name("FIELD=VALUE")
      ->allow_extra_args(false)
      ->take_all();
  estimators->add_option("--from", options->from, "s: errors from here on")
      ->check(Within("in [0, 1000000]", [](double s) { return s >= 0 && s <= 1e6; }))
      ->capture_default_str();
  estimators->callback(
      [options, command] { *command = [options] { return CompareEstimators(*options); }; });
}

}  // namespace poise
