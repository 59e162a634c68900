// Runs: messages by channel and field, metrics, checks.
#include <optional>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/metrics/metrics.h"
#include "logging/run_log_writer.h"
#include "python/bindings/bindings.h"
#include "python/run_store.h"
#include "tools/report/report.h"
#include "tools/run/run_dir.h"
#include "tools/run/scenario_run.h"
#include "tools/scenario/former_fields.h"

namespace poise::python {
namespace {

using Store = std::shared_ptr<const RunStore>;

const StoredChannel& ChannelOf(const RunStore& run, const std::string& name) {
  const StoredChannel* channel = nullptr;
  {
    const py::gil_scoped_release released;  // DERIVED is computed when it is first asked for
    channel = run.Find(name);
  }
  if (channel != nullptr) return *channel;
  std::string names;
  for (const auto& each : run.channels()) names += (names.empty() ? "" : ", ") + each->name;
  throw py::key_error(fmt::format("the run has no channel '{}'; it has {}", name, names));
}

const Leaf& LeafOf(const StoredChannel& channel, const std::string& path) {
  const Leaf* const leaf = channel.layout.Find(path);
  if (leaf == nullptr) {
    throw py::key_error(fmt::format("{} has no field '{}'", channel.type->name, path));
  }
  return *leaf;
}

/// Rows × the leaf's shape: the log's bytes in this machine's order, copied once.
py::array Column(const RunStore& run, const std::string& name, const std::string& path) {
  const StoredChannel& channel = ChannelOf(run, name);
  const Leaf& leaf = LeafOf(channel, path);
  const size_t rows = channel.ticks.size();
  py::array array = NewArray(leaf, static_cast<py::ssize_t>(rows));
  auto* to = static_cast<uint8_t*>(array.mutable_data());
  const size_t step = SizeOf(leaf.number) * leaf.elements.size();
  const py::gil_scoped_release released;
  run.CheckUnchanged();
  for (size_t row = 0; row < rows; ++row, to += step) {
    MessageLayout::Read(leaf, run.Message(channel, row), to);
  }
  return array;
}

/// All leaves of a channel in one pass over its messages.
py::dict Columns(const RunStore& run, const std::string& name) {
  const StoredChannel& channel = ChannelOf(run, name);
  const size_t rows = channel.ticks.size();
  py::dict columns;
  struct To {
    const Leaf* leaf;
    uint8_t* at;
    size_t step;
  };
  std::vector<To> to;
  for (const Leaf& leaf : channel.layout.leaves()) {
    py::array array = NewArray(leaf, static_cast<py::ssize_t>(rows));
    to.push_back({&leaf, static_cast<uint8_t*>(array.mutable_data()),
                  SizeOf(leaf.number) * leaf.elements.size()});
    columns[py::str(leaf.path)] = array;
  }
  const py::gil_scoped_release released;
  run.CheckUnchanged();
  for (size_t row = 0; row < rows; ++row) {
    const uint8_t* const message = run.Message(channel, row);
    for (To& each : to) {
      MessageLayout::Read(*each.leaf, message, each.at);
      each.at += each.step;
    }
  }
  return columns;
}

py::array_t<int64_t> Ticks(const RunStore& run, const std::string& name) {
  const StoredChannel& channel = ChannelOf(run, name);
  return py::array_t<int64_t>(static_cast<py::ssize_t>(channel.ticks.size()), channel.ticks.data());
}

std::vector<std::string> ElementNamesOf(const RunStore& run, const std::string& name,
                                        const std::string& path) {
  const StoredChannel& channel = ChannelOf(run, name);
  LeafOf(channel, path);
  return run.names().Of(channel.type->name, path.substr(0, path.find('.')));
}

Scenario ScenarioOf(const RunStore& run) {
  return LoggedScenario(run.scenario(), "the run's scenario");
}

/// nullopt: the run has no such figure.
std::optional<double> MetricValue(const RunStore& run, const std::string& name) {
  const logging::Metric* const metric = logging::FindMetric(name);
  if (metric == nullptr) throw ConfigError(logging::NoMetric(name));
  const py::gil_scoped_release released;
  const std::lock_guard lock(run.record_mutex());
  logging::RunRecord& record = run.record();
  record.first_tick = FirstCheckedTick(ScenarioOf(run), record);
  return metric->compute(record);
}

std::vector<CheckResult> Evaluate(const RunStore& run) {
  const py::gil_scoped_release released;
  const std::lock_guard lock(run.record_mutex());
  const Scenario scenario = ScenarioOf(run);
  logging::RunRecord& record = run.record();
  if (run.log().empty()) {
    record.first_tick = FirstCheckedTick(scenario, record);
  } else {
    PrepareRecord(run.log(), scenario, &record);
  }
  return EvaluateChecks(scenario, record);
}

py::list Checks(const RunStore& run) {
  py::list list;
  for (const CheckResult& check : Evaluate(run)) {
    py::dict entry;
    entry["name"] = check.name;
    entry["label"] = check.label;
    entry["unit"] = check.unit;
    entry["measured"] = check.measured;
    entry["at_least"] = check.at_least;
    entry["at_most"] = check.at_most;
    entry["paper"] = check.paper;
    entry["passed"] = check.passed;
    entry["missing"] = check.missing;
    list.append(entry);
  }
  return list;
}

py::dict Info(const RunStore& run) {
  const RunSpec& spec = run.spec();
  py::dict info;
  info["scenario"] = spec.scenario();
  info["run_id"] = spec.run_id();
  info["seed"] = spec.seed();
  info["tick_period"] = spec.tick_period();
  info["num_ticks"] = spec.num_ticks();
  info["lead_ticks"] = spec.lead_ticks();
  info["poise_version"] = spec.poise_version();
  info["poise_commit"] = spec.poise_commit();
  info["library_versions"] =
      std::vector<std::string>(spec.library_version().begin(), spec.library_version().end());
  info["log"] = run.log();
  info["damages"] = run.damages();
  return info;
}

}  // namespace

void BindRun(py::module_* module) {
  py::class_<RunStore, std::shared_ptr<RunStore>>(*module, "RunStore")
      .def_static(
          "open",
          [](const std::string& run) {
            const py::gil_scoped_release released;
            return std::make_shared<RunStore>(FindLog(run).string());
          },
          py::arg("run"))
      .def("channels",
           [](const RunStore& run) {
             std::vector<std::string> names;
             for (const auto& channel : run.channels()) names.push_back(channel->name);
             return names;
           })
      .def("type", [](const RunStore& run,
                      const std::string& name) { return ChannelOf(run, name).type->name; })
      .def("fields",
           [](const RunStore& run, const std::string& name) {
             std::vector<std::pair<std::string, std::vector<int64_t>>> fields;
             for (const Leaf& leaf : ChannelOf(run, name).layout.leaves()) {
               fields.emplace_back(leaf.path, leaf.shape);
             }
             return fields;
           })
      .def("column", &Column)
      .def("columns", &Columns)
      .def("ticks", &Ticks)
      .def("unit",
           [](const RunStore& run, const std::string& name, const std::string& path) {
             const StoredChannel& channel = ChannelOf(run, name);
             LeafOf(channel, path);
             return UnitOf(channel.type->name, path);
           })
      .def("element_names", &ElementNamesOf)
      .def("labels",
           [](const RunStore& run, const std::string& name, const std::string& path) {
             const StoredChannel& channel = ChannelOf(run, name);
             std::vector<std::string> labels = LeafOf(channel, path).Paths();
             for (std::string& label : labels) {
               label = run.names().Label(channel.type->name, label);
             }
             return labels;
           })
      .def("metric", &MetricValue)
      .def("checks", &Checks)
      .def("passed", [](const RunStore& run) { return ChecksPass(Evaluate(run)); })
      .def("info", &Info)
      .def("scenario_text", [](const RunStore& run) { return run.scenario(); })
      .def("robot_texts",
           [](const RunStore& run) { return std::pair(run.robot_text(), run.maker_text()); });
  module->def("metrics", [] {
    py::dict metrics;
    for (const logging::Metric& metric : logging::Metrics()) {
      metrics[py::str(metric.name)] = py::make_tuple(metric.unit, metric.description);
    }
    return metrics;
  });
}

}  // namespace poise::python
