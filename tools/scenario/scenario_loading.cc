#include "tools/scenario/scenario_loading.h"

#include <net/if.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <set>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "logging/metrics/metrics.h"
#include "tools/cli/lists.h"
#include "tools/reference/schemas.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/former_fields.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kSetFlag[] = "--set";
constexpr char kRobotFlag[] = "--robot";

bool InName(unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; }

/// What is wrong with the name of a scenario or variant, which becomes a part of a path; empty when
/// nothing is.
std::string NameProblem(const std::string& name) {
  if (!name.empty() && std::all_of(name.begin(), name.end(), InName)) return "";
  return fmt::format("is '{}'; use letters, digits, _ and -", name);
}

std::string VariantLabel(const Variant& variant) { return "variant " + variant.name(); }

std::string WrittenPath(const FieldChange& change) {
  return change.set.substr(0, change.set.find('='));
}

/// A change's path with indexes for elements' names, as the checks below name fields.
std::string PathOf(const LoadedScenario& loaded, const FieldChange& change) {
  try {
    return ResolvePath(loaded.scenario, WrittenPath(change));
  } catch (const ConfigError&) {
    return WrittenPath(change);  // what it named is gone by a later change
  }
}

/// The unit of a field, and how its value is written; empty when it has none.
std::string UnitHint(std::string_view path, std::string_view value) {
  std::string pattern;  // as the reference has it: [i] for every index
  for (size_t i = 0; i < path.size(); ++i) {
    pattern += path[i];
    if (path[i] != '[') continue;
    pattern += "i]";
    i = std::min(path.find(']', i), path.size() - 1);
  }
  for (const FieldEntry& entry : FieldReference(Schema::kScenario)) {
    if (entry.path != pattern || entry.unit.empty()) continue;
    const std::string text(value);
    char* end = nullptr;
    std::strtod(text.c_str(), &end);
    const auto digits = static_cast<size_t>(end - text.c_str());
    if (digits == 0) return fmt::format("; its unit is {}", entry.unit);
    return fmt::format("; its unit is {}, which is not written: {}={}", entry.unit, path,
                       text.substr(0, digits));
  }
  return "";
}

std::string NoVariant(const std::string& name, const std::vector<std::string>& names) {
  return names.empty() ? "the scenario has no variants"
                       : fmt::format("no variant named '{}'; {}", name, Suggest(name, names));
}

/// Whether `field` was changed, by one of `flags` where any is given.
bool IsChanged(const LoadedScenario& loaded, std::string_view field,
               std::initializer_list<std::string_view> flags = {}) {
  return std::ranges::any_of(loaded.changes, [&](const FieldChange& change) {
    return (flags.size() == 0 || IsAmong(change.by, flags)) && PathOf(loaded, change) == field;
  });
}

/// at_most is below at_least: says so at the one that was changed, and what to do with the other.
[[noreturn]] void FailLimits(const LoadedScenario& loaded, int index) {
  const Check& check = loaded.scenario.check(index);
  const std::string path = fmt::format("check[{}]", index);
  const bool least = IsChanged(loaded, path + ".at_least") && !IsChanged(loaded, path + ".at_most");
  const char* const other = least ? "at_most" : "at_least";
  FailField(loaded, fmt::format("{}.{}", path, least ? "at_least" : "at_most"),
            fmt::format("is {}, {} the check's {}, {}; change that too, or leave it out with --set "
                        "'check[{}].{}='",
                        least ? check.at_least() : check.at_most(), least ? "above" : "below",
                        other, least ? check.at_most() : check.at_least(), check.metric(), other));
}

void CheckScenario(const LoadedScenario& loaded) {
  const Scenario& s = loaded.scenario;
  const auto fail = [&](const std::string& field, const std::string& problem) {
    FailField(loaded, field, problem);
  };
  if (const std::string problem = NameProblem(s.name()); s.has_name() && !problem.empty()) {
    fail("name", problem);
  }
  if (!s.has_robot()) fail("robot", "is missing; name one of deploy/robots");
  try {
    RequireFields(s, {"duration"});
    CheckFields(s);
  } catch (const ConfigError& error) {
    fail(error.field(), error.problem());
  }
  if (!(s.check_from() < s.duration())) {
    if (IsChanged(loaded, "duration") && !IsChanged(loaded, "check_from")) {
      fail("duration", fmt::format("is {} s; must be more than check_from, {} s, from which on the "
                                   "scenario is checked",
                                   s.duration(), s.check_from()));
    }
    fail("check_from", "must be in [0, duration)");
  }
  for (int i = 0; i < s.check_size(); ++i) {
    if (logging::FindMetric(s.check(i).metric()) == nullptr) {
      fail(fmt::format("check[{}].metric", i), logging::NoMetric(s.check(i).metric()));
    }
    if (s.check(i).has_at_most() && s.check(i).has_at_least() &&
        s.check(i).at_most() < s.check(i).at_least()) {
      FailLimits(loaded, i);
    }
  }
  // A field of the files counts, too: an ablation may have cleared what an assumption is about.
  const Scenario files = s.assumption_size() > 0 ? loaded.files.Merged() : Scenario();
  for (int i = 0; i < s.assumption_size(); ++i) {
    const Assumption& assumption = s.assumption(i);
    if (!HasField(s, assumption.field()) && !HasField(files, assumption.field())) {
      const std::string former = FormerField(assumption.field());
      fail(fmt::format("assumption[{}].field", i),
           fmt::format("the scenario sets no field '{}'{}", assumption.field(),
                       former.empty() ? "" : "; " + former));
    }
    if (assumption.kind() != "fitted" && assumption.kind() != "assumed") {
      fail(fmt::format("assumption[{}].kind", i), "must be \"fitted\" or \"assumed\"");
    }
  }
}

bool HasOwnChecks(const LoadedScenario& loaded) {
  return loaded.variant() != nullptr && loaded.variant()->check_size() > 0;
}

/// Whether the chosen variant has asked for the change.
bool IsOfVariant(const LoadedScenario& loaded, const FieldChange& change) {
  return loaded.variant() != nullptr && change.by == VariantLabel(*loaded.variant());
}

/// The line of an error in `field`, to which `change` gave its value.
std::string Describe(const LoadedScenario& loaded, const FieldChange& change,
                     std::string_view field, std::string_view problem) {
  if (change.by == kSetFlag) {
    // The user reads the path as it was written: with the element's name.
    const std::string path = PathOf(loaded, change);
    const bool inside = field.starts_with(path);
    const std::string rest(inside ? field.substr(path.size()) : "");
    return fmt::format("{} {}: {}", change.by,
                       inside ? WrittenPath(change) + rest : std::string(field), problem);
  }
  if (!IsOfVariant(loaded, change)) {
    return fmt::format("{}: {}: {}", change.by, field, problem);
  }
  int i = loaded.variant()->set_size() - 1;
  while (i > 0 && loaded.variant()->set(i) != change.set) --i;
  const FieldPlace place =
      loaded.files.Locate(fmt::format("variant[{}].set[{}]", loaded.variant_index, i));
  return fmt::format("{}:{}: {}: {}: {}", place.file, place.line, place.field, field, problem);
}

void ReadDriveProfile(LoadedScenario* loaded);

void ApplyChange(const FieldChange& change, LoadedScenario* loaded) {
  const size_t equals = change.set.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ConfigError(Describe(*loaded, change, change.set, "must be field.path=value"));
  }
  const std::string path = change.set.substr(0, equals);
  const std::string first = path.substr(0, path.find_first_of(".["));
  // A change of what is read before any change, or is written alone, would do nothing.
  if (first == "base" || first == "remove" || first == "variant" || first == "applied") {
    throw ConfigError(Describe(*loaded, change, path,
                               first == "applied" ? "cannot be set; poise run writes it"
                                                  : "cannot be set here; write it in the "
                                                    "scenario's file"));
  }
  const std::string value = change.set.substr(equals + 1);
  try {
    SetField(&loaded->scenario, path, value);
  } catch (const ConfigError& error) {
    if (const std::string former = FormerField(path); !former.empty()) {
      throw ConfigError(Describe(*loaded, change, path, "is no field any more; " + former));
    }
    const bool wrong_value = error.problem().starts_with(fmt::format("'{}' is not ", value));
    const std::string hint = wrong_value ? UnitHint(path, value) : "";
    throw ConfigError(
        Describe(*loaded, change, error.field(), fmt::format("{}{}", error.problem(), hint)));
  }
  loaded->changes.push_back(change);
  if (path == "drive_profile") ReadDriveProfile(loaded);
}

void CheckReference(const LoadedScenario& loaded) {
  const std::vector<std::string> names = NamesOf(loaded.scenario.variant());
  const std::string& reference = loaded.scenario.reference();
  if (loaded.scenario.has_reference() && !IsAmong(reference, names)) {
    FailField(loaded, "reference", NoVariant(reference, names));
  }
}

void CheckVariants(const LoadedScenario& loaded) {
  const std::vector<std::string> names = NamesOf(loaded.scenario.variant());
  std::set<std::string> taken;
  for (size_t i = 0; i < names.size(); ++i) {
    const auto fail = [&](const std::string& problem) {
      FailField(loaded, fmt::format("variant[{}].name", i), problem);
    };
    if (const std::string problem = NameProblem(names[i]); !problem.empty()) fail(problem);
    if (!taken.insert(names[i]).second) {
      fail(fmt::format("there are two variants named '{}'", names[i]));
    }
  }
  CheckReference(loaded);
}

/// What the scenario's `ideal` gives and asks of the ideal robot.
void ApplyIdeal(LoadedScenario* loaded) {
  const Ideal ideal = loaded->scenario.ideal();
  for (const std::string& set : ideal.set()) ApplyChange({set, "--ideal"}, loaded);
  for (int i = 0; i < ideal.check_size(); ++i) {
    bool known = false;
    for (Check& check : *loaded->scenario.mutable_check()) {
      if (check.metric() != ideal.check(i).metric()) continue;
      known = true;
      const std::string label = check.label();
      check = ideal.check(i);
      if (!check.has_label()) check.set_label(label);
    }
    if (!known) {
      FailField(*loaded, fmt::format("ideal.check[{}].metric", i),
                fmt::format("the scenario has no check of '{}'", ideal.check(i).metric()));
    }
  }
}

void ApplyVariant(const std::string& name, LoadedScenario* loaded) {
  const std::vector<std::string> names = NamesOf(loaded->scenario.variant());
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw ConfigError(
        fmt::format("--variant {}: {}: {}", name, loaded->files.file(), NoVariant(name, names)));
  }
  loaded->variant_index = static_cast<int>(found - names.begin());
  const Variant variant = *loaded->variant();
  for (const std::string& set : variant.set()) ApplyChange({set, VariantLabel(variant)}, loaded);
  if (variant.check_size() > 0) *loaded->scenario.mutable_check() = variant.check();
}

/// The file that the scenario's `field` names: beside the file that says so, or the current folder
/// where --set does, then in deploy/`kind`.
std::string Resolve(const LoadedScenario& loaded, const std::string& kind, const std::string& field,
                    const std::string& name) {
  const bool set = IsChanged(loaded, field, {kSetFlag, kRobotFlag});
  try {
    return FindFile(kind, name, set ? fs::current_path() : loaded.files.FolderOf(field)).string();
  } catch (const ConfigError& error) {
    FailField(loaded, field, error.what());
  }
}

/// What a robot is given that commands may reach late.
void ApplyRealtime(LoadedScenario* loaded) {
  const auto apply = [&](const std::string& unless, const std::string& set) {
    if (!HasField(loaded->scenario, unless)) ApplyChange({set, "--realtime"}, loaded);
  };
  for (const auto& [type, entry] : Components().entries()) {
    for (const DefaultSetting& each : entry.traits.realtime) apply(each.unless, each.set);
  }
  apply("lead", "lead=5");
}

/// The ends of drives that the scenario uses.
std::vector<DriveLink> DriveLinksOf(const Scenario& scenario) {
  std::vector<DriveLink> result;
  for (const auto& [type, entry] : Components().entries()) {
    for (const DriveLink& end : entry.traits.drive_links) {
      if (HasField(scenario, end.group)) result.push_back(end);
    }
  }
  return result;
}

/// Puts the type of drives that drive_profile names into the configuration of who speaks to them.
void ReadDriveProfile(LoadedScenario* loaded) {
  Scenario* const scenario = &loaded->scenario;
  if (!scenario->has_drive_profile()) return;
  bool read = false;
  for (const DriveLink& end : DriveLinksOf(*scenario)) {
    if (end.profile.empty()) continue;
    ReadTextProto(Resolve(*loaded, "drives", "drive_profile", scenario->drive_profile()),
                  MutableGroup(scenario, end.profile));
    read = true;
  }
  if (!read) {
    FailField(*loaded, "drive_profile",
              "the run has no drives that take a type; run it with --drives ethercat, or leave it "
              "out");
  }
  scenario->clear_drive_profile();  // a run's record has the profile alone, and can be run again
}

/// The drives' link, and whose time they follow.
void ApplyDrives(const RunChanges& changes, LoadedScenario* loaded) {
  Scenario* const scenario = &loaded->scenario;
  constexpr std::string_view kRaw = "raw:";
  const bool udp = changes.link.empty() || changes.link == "udp";
  const size_t comma = changes.link.find(',');
  if (!udp && (!changes.link.starts_with(kRaw) || comma == std::string::npos)) {
    throw ConfigError(
        fmt::format("--link {}: must be udp, or raw:MASTER,DRIVES with the names of two interfaces",
                    changes.link));
  }
  const std::vector<DriveLink> ends = DriveLinksOf(*scenario);
  const auto any_has = [&](std::string DriveLink::*field) {
    return std::ranges::any_of(ends, [&](const DriveLink& end) { return !(end.*field).empty(); });
  };
  if (!changes.link.empty() && !any_has(&DriveLink::link)) {
    throw ConfigError("--link: these drives have no frames; their network interface is a setting");
  }
  if (!changes.capture.empty() && !any_has(&DriveLink::capture)) {
    throw ConfigError("--capture: these drives have no frames");
  }
  for (const DriveLink& end : ends) {
    if (!changes.realtime && !end.simulated_time.empty()) {
      ApplyChange({end.simulated_time + "=true", "--drives"}, loaded);
    }
    if (!end.link.empty() && udp) {
      MutableGroup(scenario, end.link + ".udp");
    } else if (!end.link.empty()) {
      const std::string interface = end.drives
                                        ? changes.link.substr(comma + 1)
                                        : changes.link.substr(kRaw.size(), comma - kRaw.size());
      if (if_nametoindex(interface.c_str()) == 0) {
        throw ConfigError(
            fmt::format("--link {}: there is no network interface '{}'", changes.link, interface));
      }
      ApplyChange({end.link + ".interface=" + interface, "--link"}, loaded);
    }
    if (!changes.capture.empty() && !end.capture.empty()) {
      SetField(scenario, end.capture, changes.capture);
    }
  }
}

/// The profile that the files' drive_profile names. The scenario's own, field by field, comes
/// before that of --drives; without drives that take a type it waits for them.
void ReadFirstProfile(const fs::path& overlay, LoadedScenario* loaded) {
  if (!loaded->scenario.has_drive_profile()) return;
  bool taken = false;
  for (const DriveLink& end : DriveLinksOf(loaded->scenario)) {
    if (end.profile.empty()) continue;
    taken = true;
    if (!HasField(loaded->scenario, end.profile)) continue;
    if (loaded->files.Locate("drive_profile").file == overlay.string()) {
      loaded->scenario.clear_drive_profile();
      return;
    }
    FailField(*loaded, "drive_profile",
              fmt::format("the scenario has {} as well; leave one of both out", end.profile));
  }
  if (taken) ReadDriveProfile(loaded);
}

/// What the variant sets in the group of fields at `parent`.
std::string SetsBeside(const LoadedScenario& loaded, std::string_view parent) {
  std::string sets;
  for (const FieldChange& change : loaded.changes) {
    const std::string path = PathOf(loaded, change);
    if (!IsOfVariant(loaded, change)) continue;
    if (std::string_view(path).substr(0, path.rfind('.')) != parent) continue;
    sets += (sets.empty() ? "" : ", ") + change.set;
  }
  return sets;
}

}  // namespace

void FailField(const LoadedScenario& loaded, std::string_view field, std::string_view problem) {
  const auto concerns = [&](const std::string& path) {
    return field == path || field.starts_with(path + ".") || field.starts_with(path + "[") ||
           path.starts_with(std::string(field));
  };
  // The last one counts.
  for (auto change = loaded.changes.rbegin(); change != loaded.changes.rend(); ++change) {
    if (concerns(PathOf(loaded, *change)))
      throw ConfigError(Describe(loaded, *change, field, problem));
  }
  std::string written(field);
  if (HasOwnChecks(loaded) && field.starts_with("check[")) {
    written = fmt::format("variant[{}].{}", loaded.variant_index, field);
  }
  const FieldPlace place = loaded.files.Locate(written);
  // A variant may contradict what its scenario's file says beside what it sets.
  const auto parent = [](std::string_view path) { return path.substr(0, path.rfind('.')); };
  for (const FieldChange& change : loaded.changes) {
    if (!IsOfVariant(loaded, change)) continue;
    if (parent(PathOf(loaded, change)) != parent(field) || place.line == 0) continue;
    throw ConfigError(fmt::format("{}:{}: {}: {}; {} sets {}", place.file, place.line, place.field,
                                  problem, change.by, SetsBeside(loaded, parent(field))));
  }
  if (place.line == 0) throw ConfigError(fmt::format("{}: {}: {}", place.file, field, problem));
  throw ConfigError(fmt::format("{}:{}: {}: {}", place.file, place.line, place.field, problem));
}

std::vector<std::string> EmulatedDrives() { return {"ethercat", "unitree"}; }

LoadedScenario LoadScenario(const std::string& name, const RunChanges& changes) {
  const fs::path overlay =
      changes.drives.empty() ? fs::path() : FindFile("drives", changes.drives, fs::current_path());
  LoadedScenario loaded(FindFile("scenarios", name, fs::current_path()), overlay);
  Scenario* const scenario = &loaded.scenario;
  CheckVariants(loaded);
  if (!changes.drives.empty()) ApplyDrives(changes, &loaded);
  ReadFirstProfile(overlay, &loaded);
  if (changes.realtime) ApplyRealtime(&loaded);
  for (const FieldChange& change : AblationChanges(changes.without, changes.ideal)) {
    ApplyChange(change, &loaded);
  }
  if (changes.ideal) ApplyIdeal(&loaded);
  if (!changes.variant.empty()) ApplyVariant(changes.variant, &loaded);
  if (!changes.world.empty()) ApplyChange({"engine=" + changes.world, "--world"}, &loaded);
  if (!changes.robot.empty()) ApplyChange({"robot=" + changes.robot, kRobotFlag}, &loaded);
  for (const std::string& set : changes.set) ApplyChange({set, kSetFlag}, &loaded);
  if (changes.duration) {
    ApplyChange({fmt::format("duration={}", *changes.duration), "--duration"}, &loaded);
  }
  if (changes.seed) ApplyChange({fmt::format("seed={}", *changes.seed), "--seed"}, &loaded);
  CheckReference(loaded);  // which a change may have named
  if (!changes.reference || HasOwnChecks(loaded) || changes.variant == scenario->reference()) {
    scenario->clear_reference();
  }
  CheckScenario(loaded);
  loaded.graph_file = Resolve(loaded, "graphs", "graph", scenario->graph());
  loaded.robot_file = Resolve(loaded, "robots", "robot", scenario->robot());
  Applied* const applied = scenario->mutable_applied();
  applied->Clear();
  if (!changes.variant.empty()) applied->set_variant(changes.variant);
  for (const std::string& part : changes.without) applied->add_ablation("--without " + part);
  if (changes.ideal) applied->add_ablation("--ideal");
  for (const FieldChange& change : loaded.changes) {
    Applied::Change* const entry = applied->add_change();
    entry->set_by(change.by);
    entry->set_set(change.set);
  }
  return loaded;
}

std::string NameOf(const LoadedScenario& loaded) {
  if (loaded.scenario.has_name()) return loaded.scenario.name();
  std::string name = fs::path(loaded.files.file()).stem().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !InName(c); }, '_');
  return name;
}

RunChanges ReferenceChanges(const LoadedScenario& loaded, const RunChanges& changes) {
  RunChanges reference = changes;
  reference.variant = loaded.scenario.reference();
  if (changes.realtime) {
    reference.realtime = false;
    for (const auto& [type, entry] : Components().entries()) {
      const std::vector<std::string>& lockstep = entry.traits.lockstep;
      reference.set.insert(reference.set.end(), lockstep.begin(), lockstep.end());
    }
    reference.set.push_back("lead=0");
  }
  reference.drives.clear();
  reference.drop_rate = 0;
  return reference;
}

std::string FormatChanges(const Scenario& scenario) {
  std::string text;
  std::string by;
  for (const Applied::Change& change : scenario.applied().change()) {
    const bool same = !text.empty() && change.by() == by;
    text += same ? ", " : fmt::format("{}{}: ", text.empty() ? "" : "\n", change.by());
    text += change.set();
    by = change.by();
  }
  const auto& ablations = scenario.applied().ablation();
  if (scenario.ideal().has_reason() && IsAmong("--ideal", ablations)) {
    text += fmt::format("\n--ideal: {}", scenario.ideal().reason());
  }
  return text.empty() ? "" : text + "\n";
}

bool ChangedByHand(const Scenario& scenario) {
  const Applied& applied = scenario.applied();
  return applied.has_variant() || applied.ablation_size() > 0 ||
         std::ranges::any_of(applied.change(), [](const Applied::Change& change) {
           return change.by() == kSetFlag || change.by() == kRobotFlag;
         });
}

std::string ScenarioText(const Scenario& scenario) { return TextOf(scenario); }

}  // namespace poise
