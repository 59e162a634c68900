#include "tools/sweep/sweep_definition.h"

#include <link.h>

#include <algorithm>
#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <filesystem>
#include <set>

#include "components/framework/build_info.h"
#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/modules.h"
#include "fmt/format.h"
#include "logging/metrics/metrics.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/text_table.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/library_versions.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kAllMetrics[] = "all";
// Tells of how a run went on this machine, not of what it did.
constexpr char kMachineMetric[] = "real_time_factor";

/// Throws ConfigError for what is no engine: a run would blame a change that nobody made.
void CheckEngine(const std::string& engine) {
  const std::vector<std::string> engines = EngineNames();
  if (IsAmong(engine, engines)) return;
  throw ConfigError(
      fmt::format("--world: there is no engine '{}'; {}", engine, Suggest(engine, engines)));
}

std::string Digest(const std::string& text) {
  const boost::uuids::name_generator_sha1 generator(boost::uuids::ns::oid());
  return boost::uuids::to_string(generator(text));
}

/// True for what starts like a field of a scenario, not a name of one's own.
bool IsField(const std::string& name) {
  return name.find_first_of(".[") != std::string::npos ||
         FindField(*Scenario::descriptor(), name) != nullptr;
}

/// FROM:TO[:STEPS][:FLAG...]. False when it is none.
bool ParseRange(const std::string& text, Variable* variable) {
  const std::vector<std::string> parts = Split(text, ':');
  if (parts.size() < 2) return false;
  const std::optional<double> from = NumberIn<double>(parts[0]);
  const std::optional<double> to = NumberIn<double>(parts[1]);
  if (!from || !to) return false;
  variable->set_from(*from);
  variable->set_to(*to);
  for (size_t i = 2; i < parts.size(); ++i) {
    const std::optional<int> steps = i == 2 ? NumberIn<int>(parts[i]) : std::nullopt;
    if (steps) {
      variable->set_steps(*steps);
    } else if (parts[i] == "log") {
      variable->set_scale(Variable::LOGARITHMIC);
    } else if (parts[i] == "angle") {
      variable->set_angle(true);
    } else if (parts[i] == "whole") {
      variable->set_whole(true);
    } else {
      return false;
    }
  }
  return true;
}

Variable ParseVary(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw ConfigError(
        fmt::format("--vary {}: must be NAME=FROM:TO:STEPS or NAME=VALUE,VALUE,...; "
                    "NAME is a field, or a name for --expression",
                    text));
  }
  const std::string name = text.substr(0, equals);
  const std::string rest = text.substr(equals + 1);
  Variable variable;
  const bool field = IsField(name);
  if (rest.find(':') != std::string::npos) {
    if (!ParseRange(rest, &variable)) {
      throw ConfigError(
          fmt::format("--vary {}: '{}' must be FROM:TO, FROM:TO:STEPS, and then any "
                      "of :log, :angle, :whole",
                      text, rest));
    }
  } else {
    const std::vector<std::string> values = Split(rest, ',');
    const bool numbers = std::ranges::all_of(
        values, [](const std::string& v) { return NumberIn<double>(v).has_value(); });
    if (!numbers && !field) {
      throw ConfigError(
          fmt::format("--vary {}: '{}' is no field of a scenario, so its values must "
                      "be numbers",
                      text, name));
    }
    for (const std::string& value : values) {
      if (numbers) {
        variable.add_value(*NumberIn<double>(value));
      } else {
        Choice* const choice = variable.add_choice();
        choice->set_name(value);
        choice->add_set(fmt::format("{}={}", name, value));
      }
    }
  }
  if (!field) {
    variable.set_name(name);
  } else if (variable.choice_size() == 0) {
    variable.set_field(name);
  } else {
    // A choice needs a name of its own: that of the field's last part.
    std::string last = name.substr(name.rfind('.') + 1);
    last.erase(
        std::remove_if(last.begin(), last.end(), [](char c) { return c == '[' || c == ']'; }),
        last.end());
    variable.set_name(last);
  }
  return variable;
}

Assignment ParseExpression(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ConfigError(fmt::format("--expression {}: must be FIELD=EXPRESSION", text));
  }
  Assignment assign;
  assign.set_field(text.substr(0, equals));
  assign.set_value(text.substr(equals + 1));
  return assign;
}

/// What runs beside this program's file: shared libraries that are Poise's, a user's or linked by a
/// user's, in the order they were loaded; and the programs of a user's components. The system's
/// libraries are told by their versions.
std::vector<fs::path> OwnFiles() {
  std::vector<fs::path> files;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* to) {
        const fs::path file(info->dlpi_name);
        const std::string text = file.string();
        const bool system = text.starts_with("/lib") || text.starts_with("/usr/lib");
        const bool own = file.filename().string().starts_with("libpoise") ||
                         file.parent_path().filename() == "modules";
        std::error_code error;
        if (own || (!system && fs::is_regular_file(file, error))) {
          static_cast<std::vector<fs::path>*>(to)->push_back(file);
        }
        return 0;
      },
      &files);
  for (const fs::path& folder : PoisePath()) {
    if (folder == InstalledPrefix()) continue;
    for (const char* place : {"lib/poise/components", "lib/poise/bin"}) {
      std::set<fs::path> programs;
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(folder / place, error)) {
        if (entry.is_regular_file()) programs.insert(entry.path());
      }
      files.insert(files.end(), programs.begin(), programs.end());
    }
  }
  return files;
}

bool ParsesAsScenario(const std::string& file) {
  try {
    ScenarioFiles files{fs::path(file)};
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

}  // namespace

/// Where each part of a sweep was written.
struct SweepDefinition::Source {
  std::string file;  // empty: there is none
  std::string text;
  Sweep written;  // by the file alone
  Sweep sweep;
  SweepArguments arguments;

  Source(SweepArguments given, bool limit);

  [[noreturn]] void Fail(const std::string& field, const std::string& problem) const;
  /// The flag that gave an element of a list, or the file's place.
  std::string Where(const std::string& field) const;

 private:
  void Read(const std::string& what);
};

SweepDefinition::Source::Source(SweepArguments given, bool limit) : arguments(std::move(given)) {
  Read(arguments.what);
  sweep = written;
  for (const std::string& flag : arguments.vary) *sweep.add_vary() = ParseVary(flag);
  for (const std::string& flag : arguments.expression) {
    *sweep.add_assign() = ParseExpression(flag);
  }
  for (const Constant& constant : arguments.constant) *sweep.add_constant() = constant;
  for (const std::string& name : arguments.column) sweep.add_column(name);
  if (arguments.random) sweep.set_random(*arguments.random);
  if (arguments.seed) sweep.set_seed(*arguments.seed);
  const RunChanges& changes = arguments.changes;
  if (!changes.variant.empty()) sweep.set_variant(changes.variant);
  for (const std::string& part : changes.without) sweep.add_without(part);
  if (changes.ideal) sweep.set_ideal(true);
  if (!changes.drives.empty()) sweep.set_drives(changes.drives);
  if (!changes.world.empty()) {
    CheckEngine(changes.world);
    sweep.add_set("engine=" + changes.world);
  }
  for (const std::string& set : changes.set) sweep.add_set(set);
  if (changes.duration) sweep.add_set(fmt::format("duration={}", *changes.duration));
  if (arguments.limit) sweep.mutable_limit()->MergeFrom(*arguments.limit);
  if (!limit) sweep.clear_limit();
}

void SweepDefinition::Source::Read(const std::string& what) {
  if (what.empty()) throw ConfigError("no sweep or scenario is named; see --help");
  const fs::path place = FindFileOfKinds({"sweeps", "scenarios"}, what, fs::current_path());
  const std::string found = place.string();
  text = ReadFile(found);
  try {
    ParseTextProto(text, found, &written);
  } catch (const ConfigError&) {
    if (!ParsesAsScenario(found)) throw;
    written.Clear();
    written.set_scenario(found);
    written.set_name(fs::path(found).stem().string());
    return;
  }
  file = found;
  if (!written.has_name()) written.set_name(fs::path(found).stem().string());
  if (!written.has_scenario()) Fail("scenario", "is missing; name one of deploy/scenarios");
  try {
    const fs::path scenario = FindFile("scenarios", written.scenario(), place.parent_path());
    written.set_scenario(scenario.string());
  } catch (const ConfigError& error) {
    Fail("scenario", error.what());
  }
}

std::string SweepDefinition::Source::Where(const std::string& field) const {
  const std::string last = field.substr(field.rfind('.') + 1);
  for (const auto& [list, flag, flags, before] :
       {std::tuple{"vary[", "--vary", &arguments.vary, written.vary_size()},
        std::tuple{"assign[", "--expression", &arguments.expression, written.assign_size()},
        std::tuple{"column[", "--column", &arguments.column, written.column_size()}}) {
    if (!field.starts_with(list)) continue;
    const int index = std::stoi(field.substr(std::string_view(list).size()));
    if (index < before) continue;
    return fmt::format("{} {}", flag, (*flags)[static_cast<size_t>(index - before)]);
  }
  const bool of_limit =
      field.starts_with("limit.") && arguments.limit && HasField(*arguments.limit, last);
  if (file.empty() || of_limit || (field == "random" && arguments.random)) return "--" + last;
  const int line = LocateField(text, field, Sweep());
  return line > 0 ? fmt::format("{}:{}: {}", file, line, field)
                  : fmt::format("{}: {}", file, field);
}

void SweepDefinition::Source::Fail(const std::string& field, const std::string& problem) const {
  throw ConfigError(fmt::format("{}: {}", Where(field), problem));
}

SweepDefinition::SweepDefinition(const SweepArguments& arguments, bool limit)
    : points_(Sweep()), changes_(arguments.changes) {
  const Source source(arguments, limit);
  Sweep sweep = source.sweep;
  try {
    CheckVariables(sweep, limit);
  } catch (const ConfigError& error) {
    source.Fail(error.field(), error.problem());
  }
  const std::vector<std::string> drives = EmulatedDrives();
  if (sweep.has_drives() && !IsAmong(sweep.drives(), drives)) {
    source.Fail("drives", fmt::format("is '{}'; it is {}, or left out", sweep.drives(),
                                      fmt::join(drives, " or ")));
  }
  points_ = SweepPoints(sweep);
  scenario_ = sweep.scenario();
  changes_.reference = false;
  changes_.variant = sweep.variant();
  changes_.ideal = sweep.ideal();
  changes_.drives = sweep.drives();
  changes_.without.assign(sweep.without().begin(), sweep.without().end());
  changes_.set.assign(sweep.set().begin(), sweep.set().end());
  changes_.duration.reset();  // is among `set`

  std::optional<double> first_limit;
  if (limit) first_limit = sweep.limit().min();
  Scenario base = LoadScenario(scenario_, changes_).scenario;
  CheckFields(source, base, first_limit);
  const RunChanges first = ChangesOf(0, first_limit);
  const RunSetup setup = SetUpRun(scenario_, first);
  const LoadedScenario& loaded = setup.loaded;
  const RunSpec& spec = setup.spec;
  warnings_ = setup.warnings;
  log_size_ = ExpectedLogSize(spec);

  SetColumns(source, loaded.scenario);
  CheckRequired(source, loaded.scenario);
  CheckMaps(source);

  Sweep definition = sweep;
  definition.clear_scenario();  // its text stands below
  base.clear_applied();
  std::string all = TextOf(definition) + ScenarioText(base) + TextOf(spec.graph());
  for (const Resource& resource : spec.resource()) all += resource.text();
  digest_ = Digest(all + PoiseVersion());
}

void SweepDefinition::CheckFields(const Source& source, Scenario scenario,
                                  const std::optional<double>& limit) const {
  const auto set = [&](Scenario* to, const std::string& field, std::string_view assignment) {
    const size_t equals = assignment.find('=');
    const auto fail = [&](const std::string& problem) { source.Fail(field, problem); };
    if (equals == std::string::npos || equals == 0) {
      fail(fmt::format("'{}' must be field.path=value", assignment));
    }
    try {
      SetField(to, assignment.substr(0, equals), assignment.substr(equals + 1));
    } catch (const ConfigError& error) {
      fail(error.what());
    }
  };
  const std::vector<std::string> first = points_.Changes(0, limit);
  size_t next = 0;
  for (int i = 0; i < sweep().vary_size(); ++i) {
    const Variable& variable = sweep().vary(i);
    for (int k = 0; k < variable.choice_size(); ++k) {
      Scenario copy = scenario;
      for (int n = 0; n < variable.choice(k).set_size(); ++n) {
        set(&copy, fmt::format("vary[{}].choice[{}].set[{}]", i, k, n), variable.choice(k).set(n));
      }
    }
    const int choice = points_.At(0)[static_cast<size_t>(i)].choice;
    const int sets = choice >= 0 ? variable.choice(choice).set_size() : variable.has_field();
    for (int n = 0; n < sets; ++n) set(&scenario, fmt::format("vary[{}].field", i), first[next++]);
  }
  if (limit && sweep().limit().has_field()) set(&scenario, "limit.field", first[next++]);
  for (int i = 0; i < sweep().assign_size(); ++i) {
    set(&scenario, fmt::format("assign[{}].field", i), first[next++]);
  }
}

void SweepDefinition::SetColumns(const Source& source, const Scenario& scenario) {
  std::vector<std::string> metrics;
  for (const logging::Metric& metric : logging::Metrics()) {
    if (metric.name != kMachineMetric) metrics.push_back(metric.name);
  }
  const auto add = [&](const std::string& name) {
    if (!IsAmong(name, columns_) && name != kMachineMetric) {
      columns_.push_back(name);
    }
  };
  for (int i = 0; i < sweep().column_size(); ++i) {
    if (sweep().column(i) == kAllMetrics) {
      for (const std::string& name : metrics) add(name);
    } else if (IsAmong(sweep().column(i), metrics)) {
      add(sweep().column(i));
    } else {
      source.Fail(fmt::format("column[{}]", i), logging::NoMetric(sweep().column(i)));
    }
  }
  if (sweep().column_size() == 0) {
    for (const Check& check : scenario.check()) add(check.metric());
  }
}

void SweepDefinition::CheckRequired(const Source& source, const Scenario& scenario) const {
  std::vector<std::string> limited;
  for (const Check& check : scenario.check()) {
    if (check.has_at_most() || check.has_at_least()) limited.push_back(check.metric());
  }
  for (int i = 0; i < sweep().require_size(); ++i) {
    const std::string& name = sweep().require(i);
    if (IsAmong(name, limited)) continue;
    source.Fail(
        fmt::format("require[{}]", i),
        fmt::format("the scenario checks no limit of '{}'; {}", name,
                    limited.empty() ? "it has no check with a limit" : Suggest(name, limited)));
  }
}

void SweepDefinition::CheckMaps(const Source& source) const {
  std::vector<std::string> names;
  for (const Variable& variable : sweep().vary()) names.push_back(NameOf(variable));
  for (int i = 0; i < sweep().map_size(); ++i) {
    const SweepMap& map = sweep().map(i);
    for (const auto& [field, name] : {std::pair{"x", map.x()}, std::pair{"y", map.y()}}) {
      if (name.empty() && field[0] == 'y') continue;
      if (!IsAmong(name, names)) {
        source.Fail(fmt::format("map[{}].{}", i, field),
                    fmt::format("no variable named '{}'; {}", name, Suggest(name, names)));
      }
    }
    if (map.value() != "stands" && !IsAmong(map.value(), columns_)) {
      source.Fail(fmt::format("map[{}].value", i),
                  fmt::format("is '{}', which is no column of the table; it is \"stands\" or one "
                              "of {}",
                              map.value(), Joined(columns_, ", ")));
    }
  }
}

RunChanges SweepDefinition::ChangesOf(int64_t run, const std::optional<double>& limit) const {
  RunChanges changes = changes_;
  for (std::string& set : points_.Changes(run, limit)) changes.set.push_back(std::move(set));
  return changes;
}

std::string ProgramDigest() {
  std::string all = ReadFile("/proc/self/exe");
  // Most of the program is in Poise's library.
  for (const fs::path& file : OwnFiles()) all += Digest(ReadFile(file.string()));
  return Digest(fmt::format("{} {}", all, fmt::join(LibraryVersions(), " ")));
}

}  // namespace poise
