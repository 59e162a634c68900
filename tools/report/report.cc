#include "tools/report/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "fmt/format.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/metric_needs.h"
#include "logging/metrics/metrics.h"
#include "logging/recording/inline_recorder.h"
#include "tools/cli/text_table.h"
#include "tools/report/realtime_verdict.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

std::string EndOf(const RunOutcome& outcome) {
  return outcome.message.empty() ? "planned end" : outcome.message;
}

void Evaluate(const logging::Metric& metric, const logging::RunRecord& run, CheckResult* result) {
  result->name = metric.name;
  result->unit = metric.unit;
  if (result->label.empty()) result->label = metric.description;
  result->measured = metric.compute(run);
  if (metric.name.starts_with("cop_measured") && !logging::FeetHaveSensors(run)) {
    result->label += " (observed: the feet have no sensors)";
  }
  if (!result->measured) result->missing = logging::MissingFor(metric, run);
  if (metric.joint) result->joint = metric.joint(run);
  if (!result->limited() || !result->known()) return;
  result->passed = result->measured.has_value() &&
                   (!result->at_most || *result->measured <= *result->at_most) &&
                   (!result->at_least || *result->measured >= *result->at_least);
}

/// Lower edge of bin `bin` of health_t::latency_count, us.
double BinEdge(int bin) { return std::ldexp(bin % 2 == 0 ? 1.0 : 1.5, 5 + bin / 2) * 1e-3; }

/// The bins from the first to the last that hold something.
Json HistogramJson(const health_t& health) {
  const auto& counts = health.latency_count;
  const auto filled = [](int64_t count) { return count > 0; };
  const auto first = std::find_if(std::begin(counts), std::end(counts), filled);
  const auto last = std::find_if(std::make_reverse_iterator(std::end(counts)),
                                 std::make_reverse_iterator(first), filled)
                        .base();
  Json json = Json::array();
  for (auto count = first; count < last; ++count) {
    const auto bin = static_cast<int>(count - std::begin(counts));
    json.push_back({{"from", BinEdge(bin)}, {"to", BinEdge(bin + 1)}, {"count", *count}});
  }
  return json;
}

}  // namespace

Json OrNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::vector<std::string> SchedulingNames(int8_t scheduling) {
  std::vector<std::string> names;
  if ((scheduling & health_t::SCHEDULING_FIFO) != 0) names.emplace_back("fifo");
  if ((scheduling & health_t::SCHEDULING_PINNED) != 0) names.emplace_back("pinned");
  if ((scheduling & health_t::SCHEDULING_MEMORY_LOCKED) != 0) names.emplace_back("locked");
  return names;
}

Json ComponentsJson(const std::map<std::string, health_t>& components) {
  Json json = Json::array();
  for (const auto& [name, health] : components) {
    json.push_back({{"name", name},
                    {"ticks", health.ticks_completed},
                    {"latency_us",
                     {{"median", health.latency_median},
                      {"p99", health.latency_p99},
                      {"max", health.latency_max},
                      {"histogram", HistogramJson(health)}}},
                    {"deadline_misses", health.deadline_misses},
                    {"lateness_max_us", health.lateness_max},
                    {"ticks_skipped", health.ticks_skipped},
                    {"restarts", health.restarts},
                    {"scheduling", SchedulingNames(health.scheduling)},
                    {"received", health.messages_received},
                    {"refused", health.messages_refused},
                    {"duplicates", health.messages_duplicate},
                    {"dropped", health.messages_dropped},
                    {"gaps", health.gaps},
                    {"resends", health.resends},
                    {"publish_errors", health.publish_errors}});
  }
  return json;
}

Json ChecksJson(const std::vector<CheckResult>& checks) {
  Json json = Json::array();
  for (const CheckResult& check : checks) {
    Json limit = nullptr;
    if (check.limited()) limit = FormatLimit(check);
    json.push_back({{"name", check.name},
                    {"label", check.label},
                    {"measured", OrNull(check.measured)},
                    {"unit", check.unit},
                    {"joint", check.joint.empty() ? Json(nullptr) : Json(check.joint)},
                    {"limit", limit},
                    {"at_most", OrNull(check.at_most)},
                    {"at_least", OrNull(check.at_least)},
                    {"paper", check.paper.empty() ? Json(nullptr) : Json(check.paper)},
                    {"paper_value", OrNull(check.paper_value)},
                    {"passed", check.passed},
                    {"missing", check.missing}});
  }
  return json;
}

Json EventsJson(const std::vector<logging::Event>& events) {
  Json json = Json::array();
  for (const logging::Event& event : events) {
    json.push_back({{"time", event.time}, {"name", event.name}, {"detail", event.detail}});
  }
  return json;
}

int64_t FirstCheckedTick(const Scenario& scenario, const logging::RunRecord& run) {
  const double tick = std::ceil(scenario.check_from() / run.spec.tick_period() - 1e-9) +
                      static_cast<double>(run.spec.lead_ticks());
  const auto last = static_cast<double>(run.num_ticks);
  return tick > 0 ? static_cast<int64_t>(std::min(tick, last)) : 0;
}

std::vector<CheckResult> EvaluateChecks(const Scenario& scenario, const logging::RunRecord& run) {
  std::vector<CheckResult> results;
  const bool part = run.spec.has_cut();  // what the scenario limits is of the whole run
  // An interactive run lasts as long as its person wants.
  const bool by_hand = std::ranges::any_of(
      run.health, [](const auto& each) { return each.second.detail == logging::kEndedByHand; });
  const auto reaches_end = [&](const char* metric, const RunSpec& spec) {
    CheckResult duration;
    if (part) {
      duration.label = "simulated time at which this part of the run ends";
    } else if (spec.num_ticks() > 0 && !by_hand) {
      duration.at_least =
          static_cast<double>(spec.num_ticks() - spec.lead_ticks()) * spec.tick_period();
    }
    duration.of_every_run = true;
    Evaluate(*logging::FindMetric(metric), run, &duration);
    results.push_back(std::move(duration));
  };
  reaches_end("duration_reached", run.spec);
  if (run.reference) reaches_end("duration_reached_reference", run.reference->spec);
  CheckResult defects;
  defects.of_every_run = true;
  defects.label = "defects of the log";
  defects.at_most = 0;
  results.push_back(defects);
  Evaluate(*logging::FindMetric("log_defects"), run, &results.back());
  // Whatever a scenario checks: each component did its work in every tick.
  for (const char* name : {"task_not_ok_ticks", "balance_not_ok_ticks", "command_not_ok_ticks"}) {
    CheckResult not_ok;
    not_ok.of_every_run = true;
    not_ok.at_most = 0;
    Evaluate(*logging::FindMetric(name), run, &not_ok);
    if (not_ok.measured) results.push_back(not_ok);  // else the graph has no such component
  }
  for (int i = 0; i < scenario.check_size(); ++i) {
    const Check& check = scenario.check(i);
    const logging::Metric* metric = logging::FindMetric(check.metric());
    if (metric == nullptr) {
      throw ConfigError(fmt::format("check[{}].metric", i), logging::NoMetric(check.metric()));
    }
    CheckResult result;
    result.label = check.label();
    if (check.has_at_most() && !part) result.at_most = check.at_most();
    if (check.has_at_least() && !part) result.at_least = check.at_least();
    result.paper = check.paper();
    if (check.has_paper_value()) result.paper_value = check.paper_value();
    Evaluate(*metric, run, &result);
    results.push_back(std::move(result));
  }
  return results;
}

std::string FormatLimit(const CheckResult& check) {
  if (check.at_most && check.at_least) {
    if (*check.at_most == *check.at_least) return "= " + FormatNumber(*check.at_most, check.unit);
    return fmt::format("{} … {}", FormatNumber(*check.at_least),
                       FormatNumber(*check.at_most, check.unit));
  }
  if (check.at_most) return "≤ " + FormatNumber(*check.at_most, check.unit);
  if (check.at_least) return "≥ " + FormatNumber(*check.at_least, check.unit);
  return "";
}

bool ChecksPass(const std::vector<CheckResult>& checks) {
  const auto judges = [](const CheckResult& check) {
    return check.limited() && !check.of_every_run;
  };
  return std::ranges::all_of(checks, &CheckResult::passed) &&
         (std::ranges::none_of(checks, judges) ||
          std::ranges::any_of(
              checks, [&](const CheckResult& check) { return judges(check) && check.known(); }));
}

std::string FormatUnknown(const std::vector<CheckResult>& checks, bool all) {
  std::string text;
  for (const CheckResult& check : checks) {
    if (check.known() || (!all && !check.limited())) continue;
    text += ScreenLines(4, "  not known: {} ({}), which needs {}", check.label, check.name,
                        fmt::join(check.missing, " and "));
  }
  return text;
}

std::string FormatTable(const std::vector<CheckResult>& checks) {
  std::vector<TableRow> rows = {{"what", "measured", "limit", "paper", "verdict"}};
  for (const CheckResult& check : checks) {
    rows.push_back(
        {check.label, FormatMeasured(check), FormatLimit(check), check.paper, VerdictCell(check)});
  }
  return FormatColumns(rows);
}

TableCell VerdictCell(const CheckResult& check) {
  if (!check.limited()) return "";
  if (!check.known()) return "not known";
  return check.passed ? TableCell("ok", Tone::kGood) : TableCell("FAILED", Tone::kBad);
}

std::string FormatMeasured(const CheckResult& check) {
  if (!check.measured) return check.known() ? "none" : "not known";
  std::string number = FormatNumber(*check.measured);
  // Where a limit is broken by less than is shown, there are as many digits as tell the two apart.
  for (const std::optional<double>& limit : {check.at_least, check.at_most}) {
    const bool same = !check.passed && limit && number == FormatNumber(*limit);
    for (int digits = 5; same && digits <= 17; ++digits) {
      number = fmt::format("{:.{}g}", *check.measured, digits);
      if (number != fmt::format("{:.{}g}", *limit, digits)) break;
    }
  }
  if (!check.unit.empty()) number += " " + check.unit;
  return check.joint.empty() ? number : fmt::format("{}, {}", number, check.joint);
}

std::string FormatFaults(const RunOutcome& outcome) {
  if (outcome.faults.empty()) return "";
  std::vector<TableRow> rows = {
      {"fault", "process", "at s", "control regained after ms", "cycles without command"}};
  std::vector<double> regained;
  for (const InjectedFault& fault : outcome.faults) {
    const bool known = fault.regained >= 0;
    if (known) regained.push_back(fault.regained * 1e3);
    rows.push_back({fault.killed ? "killed" : "stopped 100 ms", fault.process,
                    fmt::format("{:.3f}", fault.time),
                    known ? fmt::format("{:.1f}", fault.regained * 1e3) : "never",
                    fmt::format("{}", fault.cycles)});
  }
  std::sort(regained.begin(), regained.end());
  std::string text = fmt::format("\n{}", FormatColumns(rows));
  text += fmt::format("{} faults, {} processes replaced, control regained after {}",
                      outcome.faults.size(), outcome.takeovers, regained.size());
  if (!regained.empty()) {
    text += fmt::format(": median {:.1f} ms, worst {:.1f} ms", regained[regained.size() / 2],
                        regained.back());
  }
  return text + "\n";
}

std::string FormatProcesses(const RunOutcome& outcome) {
  if (outcome.processes.empty()) return "";
  std::vector<TableRow> rows = {{"process", "ticks", "median us", "p99 us", "worst us",
                                 "missed deadlines", "latest start us", "skipped ticks", "replaced",
                                 "scheduling", "memory MB", "grown by kB"}};
  for (const ProcessReport& process : outcome.processes) {
    const health_t& h = process.health;
    const std::vector<std::string> granted = SchedulingNames(h.scheduling);
    const bool measured = process.resident_first > 0;
    rows.push_back(
        {h.component, fmt::format("{}", h.ticks_completed), FormatNumber(h.latency_median),
         FormatNumber(h.latency_p99), FormatNumber(h.latency_max),
         fmt::format("{}", h.deadline_misses), FormatNumber(h.lateness_max),
         fmt::format("{}", h.ticks_skipped), fmt::format("{}", h.restarts),
         granted.empty() ? "ordinary" : Joined(granted, ", "),
         measured ? FormatNumber(static_cast<double>(process.resident_last) * 1e-6) : "",
         measured ? fmt::format("{}", (process.resident_last - process.resident_first) / 1024)
                  : ""});
  }
  return fmt::format("\n{}", FormatColumns(rows));
}

std::string FormatAssumptions(const Scenario& scenario) {
  if (scenario.assumption_size() == 0) return "";
  std::string text = "Not given by the paper:\n";
  for (const Assumption& assumption : scenario.assumption()) {
    const std::string value = ValueText(scenario, assumption.field());
    text += ScreenLines(11, "  {:<7}  {}{}{}", assumption.kind(), assumption.field(),
                        value.empty() ? "" : " = " + value,
                        assumption.has_reason() ? ": " + assumption.reason() : "");
  }
  return text;
}

std::vector<CheckResult> ChecksOf(const nlohmann::json& summary) {
  const auto number = [](const nlohmann::json& value) {
    return value.is_null() ? std::nullopt : std::optional(value.get<double>());
  };
  std::vector<CheckResult> checks;
  for (const nlohmann::json& json : summary.at("checks")) {
    CheckResult check;
    check.name = json.at("name").get<std::string>();
    check.label = json.at("label").get<std::string>();
    check.unit = json.at("unit").get<std::string>();
    check.measured = number(json.at("measured"));
    check.at_most = number(json.at("at_most"));
    check.at_least = number(json.at("at_least"));
    if (!json.at("paper").is_null()) check.paper = json.at("paper").get<std::string>();
    check.paper_value = number(json.at("paper_value"));
    check.passed = json.at("passed").get<bool>();
    // A summary of an earlier version has none.
    if (json.contains("missing")) check.missing = json["missing"].get<std::vector<std::string>>();
    checks.push_back(std::move(check));
  }
  return checks;
}

Json RunJson(const Scenario& scenario, const logging::RunRecord& run,
             const std::vector<CheckResult>& checks) {
  Json json;
  json["scenario"] = run.spec.scenario();
  json["paper_section"] = scenario.paper_section();
  json["run_id"] = run.spec.run_id();
  json["started_at"] = run.info.started_at;
  json["poise_commit"] = run.spec.poise_commit();
  json["instruction_set"] = run.spec.instruction_set();
  json["versions"]["poise"] = run.spec.poise_version();
  for (const std::string& library : run.spec.library_version()) {
    const size_t space = library.find(' ');
    json["versions"][library.substr(0, space)] =
        library.substr(std::min(space, library.size() - 1) + 1);
  }
  json["variant"] =
      scenario.applied().has_variant() ? Json(scenario.applied().variant()) : Json(nullptr);
  json["ablations"] = Json::array();
  for (const std::string& flag : scenario.applied().ablation()) json["ablations"].push_back(flag);
  json["changes"] = Json::array();
  for (const Applied::Change& change : scenario.applied().change()) {
    json["changes"].push_back({{"by", change.by()}, {"set", change.set()}});
  }
  json["realtime"] = run.spec.realtime();
  json["seed"] = std::to_string(run.spec.seed());  // 64 bits: beyond a double's integers
  json["drop_rate"] = run.spec.drop_rate();
  json["tick_period"] = run.spec.tick_period();
  json["lead_ticks"] = run.spec.lead_ticks();
  json["planned_ticks"] = run.spec.num_ticks();
  json["ticks"] = run.num_ticks;
  json["cut"] = nullptr;
  if (run.spec.has_cut()) {
    json["cut"] = {{"first_tick", run.spec.cut().first_tick()},
                   {"last_tick", run.spec.cut().last_tick()}};
  }
  json["simulated_time"] = run.time(run.num_ticks);
  json["real_time_factor"] = OrNull(run.real_time_factor);
  json["refused_health"] = run.refused_health;
  json["log"] = "run.lcm";
  json["components"] = ComponentsJson(run.health);
  json["channels"] = Json::array();
  for (const logging::ChannelCompleteness& channel : run.channels) {
    json["channels"].push_back({{"name", channel.name},
                                {"messages", channel.messages},
                                {"missing", channel.missing},
                                {"duplicate", channel.duplicate},
                                {"out_of_order", channel.out_of_order},
                                {"refused", channel.refused}});
  }
  json["checks"] = ChecksJson(checks);
  json["assumptions"] = Json::array();
  for (const Assumption& assumption : scenario.assumption()) {
    json["assumptions"].push_back({{"field", assumption.field()},
                                   {"value", ValueText(scenario, assumption.field())},
                                   {"kind", assumption.kind()},
                                   {"reason", assumption.reason()}});
  }
  return json;
}

std::string SummaryJson(const Scenario& scenario, const logging::RunRecord& run,
                        const RunSummary& summary) {
  const RunOutcome& outcome = summary.outcome;
  Json json = RunJson(scenario, run, summary.checks);
  json["mode"] = summary.mode;
  json["wall_time"] = outcome.wall_time;
  json["passed"] = summary.passed;
  json["failed_by_machine"] = summary.failed_by_machine;
  json["machine"] = RealtimeJson(run.spec, outcome, summary.lost);
  json["end"] = EndOf(outcome);
  json["completed"] = outcome.completed;
  json["interrupted"] = outcome.interrupted;
  json["reference"] = nullptr;
  if (summary.reference) {
    json["reference"] = {{"variant", scenario.reference()},
                         {"end", EndOf(*summary.reference)},
                         {"completed", summary.reference->completed},
                         {"log", "reference/run.lcm"}};
  }
  json["launcher"]["refused"] = outcome.refused;
  json["launcher"]["strangers"] = outcome.strangers;
  json["launcher"]["warnings"] = outcome.warnings;
  json["events"] = EventsJson(summary.events);
  // Names and texts of a log may hold any bytes.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace poise
