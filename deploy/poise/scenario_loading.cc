#include "deploy/poise/scenario_loading.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <filesystem>

#include "components/framework/configuration.h"
#include "components/framework/suggest.h"
#include "deploy/poise/catalog.h"
#include "fmt/format.h"
#include "logging/metrics.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr double kMinRate = 50;     // Hz
constexpr double kMaxRate = 10000;  // Hz

void CheckScenario(const LoadedScenario& loaded) {
  const Scenario& s = loaded.scenario;
  const auto fail = [&](const std::string& field, const std::string& problem) {
    FailField(loaded, field, problem);
  };
  if (!s.has_robot()) fail("robot", "is missing; name one of deploy/robots");
  if (!(s.duration() > 0) || s.duration() > 36000) {
    fail("duration", fmt::format("is {} s; must be in (0, 36000]", s.duration()));
  }
  if (!(s.tick_rate() >= kMinRate && s.tick_rate() <= kMaxRate)) {
    fail("tick_rate",
         fmt::format("is {} Hz; must be in [{}, {}]", s.tick_rate(), kMinRate, kMaxRate));
  }
  if (!(s.check_from() >= 0 && s.check_from() < s.duration())) {
    fail("check_from", "must be in [0, duration)");
  }
  std::vector<std::string> names;
  for (const logging::Metric& metric : logging::Metrics()) names.push_back(metric.name);
  for (int i = 0; i < s.check_size(); ++i) {
    if (logging::FindMetric(s.check(i).metric()) == nullptr) {
      fail(fmt::format("check[{}].metric", i),
           fmt::format("no metric named '{}'; {}; see `poise list metrics`", s.check(i).metric(),
                       Suggest(s.check(i).metric(), names)));
    }
    if (s.check(i).has_at_most() && s.check(i).has_at_least() &&
        s.check(i).at_most() < s.check(i).at_least()) {
      fail(fmt::format("check[{}].at_most", i), "is smaller than at_least");
    }
  }
  for (int i = 0; i < s.assumption_size(); ++i) {
    const Assumption& assumption = s.assumption(i);
    if (!HasField(s, assumption.field())) {
      fail(fmt::format("assumption[{}].field", i),
           fmt::format("the scenario sets no field '{}'", assumption.field()));
    }
    if (assumption.kind() != "fitted" && assumption.kind() != "assumed") {
      fail(fmt::format("assumption[{}].kind", i), "must be \"fitted\" or \"assumed\"");
    }
  }
}

/// File of deploy/`kind` that the scenario's `field` names.
std::string Resolve(const LoadedScenario& loaded, const std::string& kind, const std::string& field,
                    const std::string& name) {
  try {
    return FindFile(kind, name, loaded.files.FolderOf(field)).string();
  } catch (const ConfigError& error) {
    FailField(loaded, field, error.what());
  }
}

}  // namespace

void FailField(const LoadedScenario& loaded, std::string_view field, std::string_view problem) {
  const auto set_by = [&](const std::string& path) {
    return field == path || field.starts_with(path + ".") || path.starts_with(std::string(field));
  };
  if (std::any_of(loaded.changed.begin(), loaded.changed.end(), set_by)) {
    throw ConfigError(fmt::format("--set {}: {}", field, problem));
  }
  const FieldPlace place = loaded.files.Locate(field);
  if (place.line == 0) throw ConfigError(fmt::format("{}: {}: {}", place.file, field, problem));
  throw ConfigError(fmt::format("{}:{}: {}: {}", place.file, place.line, place.field, problem));
}

LoadedScenario LoadScenario(const std::string& name, const RunChanges& changes) {
  LoadedScenario loaded(FindFile("scenarios", name, fs::current_path()));
  for (const std::string& change : changes.set) {
    const size_t equals = change.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw ConfigError(fmt::format("--set {}: must be field.path=value", change));
    }
    const std::string path = change.substr(0, equals);
    try {
      SetField(&loaded.scenario, path, change.substr(equals + 1));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("--set {}", error.what()));
    }
    loaded.changed.push_back(path);
  }
  if (changes.duration) {
    loaded.scenario.set_duration(*changes.duration);
    loaded.changed.push_back("duration");
  }
  if (changes.seed) loaded.scenario.set_seed(*changes.seed);
  CheckScenario(loaded);
  loaded.graph_file = Resolve(loaded, "graphs", "graph", loaded.scenario.graph());
  loaded.robot_file = Resolve(loaded, "robots", "robot", loaded.scenario.robot());
  return loaded;
}

std::string ScenarioText(const Scenario& scenario) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(scenario, &text);
  return text;
}

}  // namespace poise
