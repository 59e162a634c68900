#include "tools/sweep/sweep_run.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "components/framework/runners/inline_runner.h"
#include "components/robot/robot_model.h"
#include "fmt/format.h"
#include "logging/events/events.h"
#include "logging/metrics/metrics.h"
#include "logging/metrics/schedule_plan.h"
#include "logging/recording/inline_record.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/lists.h"
#include "tools/cli/temporary_dir.h"
#include "tools/cli/text_table.h"
#include "tools/report/fall_story.h"
#include "tools/report/report.h"
#include "tools/run/run_dir.h"
#include "tools/run/scenario_run.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// Whether one process cannot hold the run.
bool NeedsProcesses(const RunSpec& spec, const RunChanges& changes) {
  return !changes.drives.empty() || !OwnProgramOf(spec.graph()).empty();
}

/// Runs as processes and reads the log; empty where not all ticks until the run's end were done:
/// `row` says why.
std::optional<logging::RunRecord> RecordOfProcesses(const std::string& scenario,
                                                    const RunSetup& setup,
                                                    const RunChanges& changes,
                                                    const std::string& log_dir, SweepRow* row) {
  std::optional<TemporaryDir> temporary;
  if (log_dir.empty()) temporary.emplace("poise-sweep");
  const fs::path folder = temporary ? temporary->path() / "run" : fs::path(log_dir);
  RunOptions options;
  options.changes = changes;
  options.quiet = true;
  options.force = true;
  ScenarioRun run(scenario, {setup.loaded, setup.spec, {}, {}}, options);
  const RunOutcome outcome = run.RunOnly(folder.string());
  if (outcome.interrupted) throw std::runtime_error(outcome.message);
  row->component = outcome.fault.component;
  row->reason = outcome.fault.what;
  if (outcome.ticks_done) return logging::ReadRun(folder / "run.lcm");
  using Kind = RunFault::Kind;
  row->outcome = outcome.fault.kind == Kind::kCrashed ? kCrashed
                 : outcome.fault.kind == Kind::kHung  ? kHung
                                                      : kStopped;
  return {};
}

/// Runs to the end and takes the record, from memory or from the log in `log_dir`.
logging::RunRecord Record(RunSetup* setup, const std::string& log_dir, TaskStatus* status,
                          SweepRow* row) {
  const RunSpec& spec = setup->spec;
  InlineRunner runner(spec, std::move(*setup->graph));
  std::vector<std::pair<std::string, std::string>> stages;
  for (const InlineRunner::StageName& name : runner.StageNames()) {
    stages.emplace_back(name.component, name.stage);
  }
  status->SetRun(stages, spec.tick_period(), spec.lead_ticks());
  runner.set_position(status->position());
  const auto run = [&] {
    while (runner.Step()) {
    }
    row->component = runner.end_component();
    row->reason = runner.end_detail().substr(
        std::min(runner.end_detail().size(),
                 row->component.empty() ? 0 : row->component.size() + std::strlen(": ")));
  };
  const std::string text = ScenarioText(setup->loaded.scenario);
  if (log_dir.empty()) {
    logging::InlineRecord record(spec, text, &runner);
    run();
    return record.Take();
  }
  const RunDir dir = MakeRunDir(log_dir, spec.scenario(), /*force=*/true);
  const run_info_t info = logging::MakeRunInfo(spec, text);
  WriteRunFiles(dir.path(), info);
  const fs::path log = dir.path() / "run.lcm";
  logging::InlineRecorder recorder(log, spec, info, &runner);
  run();
  recorder.Close(spec);
  return logging::ReadRun(log);
}

std::string PhaseAtEnd(const logging::RunRecord& run) {
  const planner_status_t* planner = run.planner.at(run.num_ticks - 1);
  if (planner == nullptr) return "";
  const auto phase = static_cast<size_t>(planner->phase);
  const auto schedule = logging::ReadSchedulePlan(run);
  const bool named = schedule && phase < schedule->size() && !(*schedule)[phase].name.empty();
  return named ? (*schedule)[phase].name : std::to_string(planner->phase);
}

void ReadEvents(const logging::RunRecord& run, SweepRow* row) {
  const std::vector<logging::Event> events = logging::Events(run);
  const auto fall = std::ranges::find(events, std::string("fall"), &logging::Event::name);
  std::vector<std::string> troubles;
  const auto add = [&](const std::string& name) {
    if (!IsAmong(name, troubles)) troubles.push_back(name);
  };
  if (fall != events.end()) {
    row->fell_at = fall->time;
    for (const Trouble& trouble : TroublesBefore(fall->time, events)) add(trouble.name);
  } else {
    for (const logging::Event& event : events) {
      if (IsTrouble(event.name)) add(event.name);
    }
  }
  row->trouble = Joined(troubles, "+");
}

/// Whether a run that stands did what it was to do: the limits of the required checks.
void Judge(const Scenario& scenario, const std::vector<std::string>& required,
           const logging::RunRecord& run, SweepRow* row) {
  for (const CheckResult& check : EvaluateChecks(scenario, run)) {
    if (check.passed || !IsAmong(check.name, required)) continue;
    row->outcome = kMissed;
    row->reason += fmt::format("{}{}: {}, must be {}", row->reason.empty() ? "" : "; ", check.label,
                               FormatMeasured(check), FormatLimit(check));
  }
}

}  // namespace

SweepRow RunPoint(const std::string& scenario, const RunChanges& changes,
                  const std::vector<std::string>& metrics, const std::vector<std::string>& required,
                  const std::string& log_dir, SweepRow row, TaskStatus* status) {
  std::optional<RunSetup> setup;
  try {
    setup.emplace(SetUpRun(scenario, changes));
  } catch (const ConfigError& error) {
    row.outcome = kInvalid;
    row.reason = error.what();
    return row;
  } catch (const robot::RobotError& error) {
    row.outcome = kInvalid;
    row.reason = error.what();
    return row;
  }
  const Scenario& merged = setup->loaded.scenario;
  std::optional<logging::RunRecord> record;
  if (NeedsProcesses(setup->spec, changes)) {
    status->SetWatchedElsewhere();  // by the launcher
    setup->graph.reset();
    record = RecordOfProcesses(scenario, *setup, changes, log_dir, &row);
    if (!record) return row;
  } else {
    record = Record(&*setup, log_dir, status, &row);
  }
  logging::RunRecord& run = *record;
  status->Step();
  run.first_tick = FirstCheckedTick(merged, run);
  ReadEvents(run, &row);
  const bool whole = run.num_ticks >= run.spec.num_ticks() && row.reason.empty();
  row.outcome = row.fell_at ? kFell : whole ? kStands : kStopped;
  if (row.fell_at && !row.component.empty()) {  // who tells of the fall
    row.reason = fmt::format("{}: {}", row.component, row.reason);
    row.component.clear();
  }
  row.ended_at = run.time(run.num_ticks);
  row.phase = PhaseAtEnd(run);
  // A run that was stopped tells nothing: its `fallen` would be 0.
  if (row.survived()) {
    for (const std::string& name : metrics) {
      const logging::Metric* const metric = logging::FindMetric(name);
      status->Step();
      const logging::Answer value = metric->compute(run);
      if (value && std::isfinite(*value)) row.metrics[metric->name] = *value;
    }
  }
  status->Step();
  if (row.stands() && !required.empty()) Judge(merged, required, run, &row);
  row.push = FindPushBound(merged, run);
  return row;
}

std::string SweepRow::Ending() const {
  std::string text = outcome;
  if (!component.empty()) text += " in " + component;
  if (!stage.empty()) text += ", stage " + stage;
  if (!component.empty() && ended_at != 0) text += fmt::format(", at {:.3f} s", ended_at);
  return text + (reason.empty() ? "" : ": " + reason);
}

std::string SweepRow::RowText(const SweepRow& row) {
  ordered_json json = {{"run", row.run}};
  if (row.limit) json["limit"] = *row.limit;
  json["outcome"] = row.outcome;
  if (row.fell_at) json["fell_at"] = *row.fell_at;
  json["ended_at"] = row.ended_at;
  json["phase"] = row.phase;
  json["trouble"] = row.trouble;
  json["reason"] = row.reason;
  if (!row.component.empty()) json["component"] = row.component;
  if (!row.stage.empty()) json["stage"] = row.stage;
  json["metrics"] = row.metrics;
  if (row.push) {
    json["push"] = {{"impulse", row.push->impulse}, {"mass", row.push->mass}};
    if (row.push->bounded()) {
      json["push"]["height"] = row.push->height;
      json["push"]["distance"] = row.push->distance;
      json["push"]["lip_impulse"] = row.push->lip_impulse;
      json["push"]["lip_impulse_of_duration"] = row.push->lip_impulse_of_duration;
    }
    if (row.push->step_time > 0) {
      json["push"]["reach"] = row.push->reach;
      json["push"]["step_time"] = row.push->step_time;
      json["push"]["step_impulse"] = row.push->step_impulse;
    }
  }
  // A scenario's words may be any bytes.
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

SweepRow SweepRow::Parse(const std::string& text) {
  const nlohmann::json json = nlohmann::json::parse(text);
  SweepRow row;
  row.run = json.at("run").get<int64_t>();
  if (json.contains("limit")) row.limit = json["limit"].get<double>();
  row.outcome = json.at("outcome").get<std::string>();
  if (json.contains("fell_at")) row.fell_at = json["fell_at"].get<double>();
  row.ended_at = json.at("ended_at").get<double>();
  row.phase = json.at("phase").get<std::string>();
  row.trouble = json.at("trouble").get<std::string>();
  row.reason = json.at("reason").get<std::string>();
  row.component = json.value("component", "");
  row.stage = json.value("stage", "");
  row.metrics = json.at("metrics").get<std::map<std::string, double>>();
  if (json.contains("push")) {
    const nlohmann::json& push = json["push"];
    row.push =
        PushBound{push.at("impulse").get<double>(), push.at("mass").get<double>(),
                  push.value("height", 0.0),        push.value("distance", 0.0),
                  push.value("lip_impulse", 0.0),   push.value("lip_impulse_of_duration", 0.0),
                  push.value("reach", 0.0),         push.value("step_time", 0.0),
                  push.value("step_impulse", 0.0)};
  }
  return row;
}

}  // namespace poise
