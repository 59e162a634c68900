#include "tools/scenario/run_setup.h"

#include <google/protobuf/message.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <thread>
#include <utility>

#include "components/framework/build_info.h"
#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_path.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/file_descriptor.h"
#include "components/framework/optional_ports.h"
#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tools/cli/lists.h"
#include "tools/cli/stall_watch.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/graph_files.h"
#include "tools/scenario/library_versions.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

// Below the ephemeral ports that the system gives to sockets of its own choice.
constexpr int kFirstPort = 12000;
constexpr int kLastPort = 32000;

constexpr char kControllerProcess[] = "controller";  // of --hosted

using google::protobuf::FieldDescriptor;

/// The scenario's field `section`, which holds a configuration; nullptr when there is none.
const FieldDescriptor* ConfigField(const std::string& section) {
  const auto* field = FindField(*Scenario::descriptor(), section);
  const bool is_config = field != nullptr && !field->is_repeated() &&
                         field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  return is_config ? field : nullptr;
}

/// The scenario's fields that hold the configuration of a component of this type.
std::vector<std::string> SectionsOf(const std::string& type) {
  const std::vector<std::string>& sections = Components().TraitsOf(type).sections;
  return sections.empty() ? std::vector<std::string>{type} : sections;
}

/// The message whose text is the configuration of a component of this type: its section, made where
/// `scenario` has none yet; of several sections a scenario that has these alone. nullptr: none.
google::protobuf::Message* ConfigIn(Scenario* scenario, const std::string& type) {
  const std::vector<std::string> sections = SectionsOf(type);
  if (sections.size() > 1) return scenario;
  const FieldDescriptor* field = ConfigField(sections[0]);
  return field == nullptr ? nullptr : scenario->GetReflection()->MutableMessage(scenario, field);
}

/// The configuration of a component of this type, as it will read it.
std::string ConfigText(const Scenario& scenario, const std::string& type) {
  const google::protobuf::Reflection& reflection = *scenario.GetReflection();
  Scenario own;
  for (const std::string& section : SectionsOf(type)) {
    const FieldDescriptor* field = ConfigField(section);
    if (field == nullptr || !reflection.HasField(scenario, field)) continue;
    reflection.MutableMessage(&own, field)->CopyFrom(reflection.GetMessage(scenario, field));
  }
  const google::protobuf::Message* const config = ConfigIn(&own, type);
  return config == nullptr ? "" : TextOf(*config);
}

/// Writes the configuration of every component of the run's graph.
void WriteConfigs(const Scenario& scenario, RunSpec* spec) {
  spec->clear_config();
  for (const ComponentInstance& instance : spec->graph().component()) {
    ComponentConfig* config = spec->add_config();
    config->set_component(instance.name());
    config->set_text(ConfigText(scenario, TypeOf(instance)));
  }
}

/// ConfigText's inverse, for a run that a log holds: the sections alone.
Scenario ReadConfig(const ComponentConfig& config, const std::string& type) {
  Scenario own;
  if (google::protobuf::Message* const message = ConfigIn(&own, type)) {
    ParseTextProto(config.text(), "configuration of " + config.component(), message);
  }
  return own;
}

/// Where the run keeps a component's configuration; -1 when it has none.
int ConfigIndex(const RunSpec& spec, const ComponentInstance& instance) {
  int i = spec.config_size() - 1;
  while (i >= 0 && spec.config(i).component() != instance.name()) --i;
  return i;
}

/// The scenario's path of a field of a component's own configuration.
std::string ScenarioPath(const std::string& type, const std::string& field) {
  const std::vector<std::string> sections = SectionsOf(type);
  if (sections.size() > 1) return field;
  return field.empty() ? sections[0] : sections[0] + "." + field;
}

std::string InCapitals(std::string name) {
  for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return name;
}

/// Gives the outputs that not every run has a channel, or takes it away.
void ConnectWhere(const Scenario& scenario, ComponentInstance* instance, Graph* graph) {
  for (const OptionalPort& optional : OptionalPortsOf(TypeOf(*instance))) {
    if (!optional.brings_channel) continue;
    const bool wanted = IsThere(optional, scenario);
    const auto& outputs = instance->output();
    const auto& channels = graph->channel();
    const auto output = std::ranges::find(outputs, optional.port, &Connection::port);
    if (wanted && output == outputs.end()) {
      const std::string name = InCapitals(optional.port);
      if (std::ranges::find(channels, name, &Channel::name) == channels.end()) {
        Channel* const channel = graph->add_channel();
        channel->set_name(name);
        channel->set_type(optional.type);
      }
      Connection* const connection = instance->add_output();
      connection->set_port(optional.port);
      connection->set_channel(name);
    } else if (!wanted && output != outputs.end()) {
      const auto channel = std::ranges::find(channels, output->channel(), &Channel::name);
      if (channel != channels.end()) {
        graph->mutable_channel()->DeleteSubrange(static_cast<int>(channel - channels.begin()), 1);
      }
      instance->mutable_output()->DeleteSubrange(static_cast<int>(output - outputs.begin()), 1);
    }
  }
}

/// Puts the engine that the scenario names in the place of the graph's.
void ChooseEngine(const LoadedScenario& loaded, Graph* graph) {
  const std::string& engine = loaded.scenario.engine();
  if (!loaded.scenario.has_engine()) return;
  std::string chosen;
  for (const auto& [type, entry] : Components().entries()) {
    if (entry.traits.engine == engine) chosen = type;
  }
  if (engine.empty() || chosen.empty()) {
    FailField(loaded, "engine",
              fmt::format("there is no engine '{}'; {}", engine, Suggest(engine, EngineNames())));
  }
  bool found = false;
  for (ComponentInstance& instance : *graph->mutable_component()) {
    if (Components().TraitsOf(TypeOf(instance)).engine.empty()) continue;
    instance.set_type(chosen);
    found = true;
  }
  if (!found) {
    FailField(loaded, "engine",
              fmt::format("the graph {} simulates no robot; leave engine out", graph->name()));
  }
}

/// The ends of drives that components of the graph use.
std::vector<DriveLink> DriveLinksOf(const Graph& graph, const Scenario& scenario) {
  std::vector<DriveLink> used;
  for (const ComponentInstance& instance : graph.component()) {
    std::ranges::copy_if(Components().TraitsOf(TypeOf(instance)).drive_links,
                         std::back_inserter(used),
                         [&](const DriveLink& end) { return HasField(scenario, end.group); });
  }
  return used;
}

/// Refuses a graph without what emulates the drives of --drives: its bridge would look for a robot.
void CheckDrivesOf(const RunChanges& changes, const LoadedScenario& loaded, const Graph& graph) {
  if (changes.drives.empty()) return;
  const std::vector<DriveLink> ends = DriveLinksOf(graph, loaded.scenario);
  if (std::ranges::any_of(ends, &DriveLink::drives)) return;
  const fs::path overlay = FindFile("drives", changes.drives, fs::current_path());
  Scenario drives;
  ReadTextProto(overlay.string(), &drives);
  FailField(loaded, "graph",
            fmt::format("the graph {} ({}) has no emulated drives; --drives {} runs {}: base yours "
                        "on that, or leave --drives out",
                        graph.name(), loaded.graph_file, changes.drives, drives.graph()));
}

/// Refuses what another engine than the run's is told: it would change nothing.
void CheckEngineOf(const std::vector<std::string>& changes, const Graph& graph) {
  const std::string engine = EngineOf(graph);
  if (engine.empty()) return;
  for (const std::string& change : changes) {
    const std::string other = EngineOfField(change);
    if (other.empty() || other == engine) continue;
    throw ConfigError(fmt::format("--set {}: the run's engine is {}; --world {} takes it", change,
                                  engine, other));
  }
}

void PutInto(const std::string& process, const std::vector<std::string>& components,
             const std::string& flag, Graph* graph) {
  const std::vector<std::string> names = NamesOf(graph->component());
  for (const std::string& component : components) {
    const auto found = std::ranges::find(names, component);
    if (found == names.end()) {
      throw ConfigError(fmt::format("{}: the graph {} has no component '{}'; {}", flag,
                                    graph->name(), component, Suggest(component, names)));
    }
    graph->mutable_component(static_cast<int>(found - names.begin()))->set_process(process);
  }
  const std::vector<GraphError::Problem> problems = ProcessProblems(*graph);
  if (!problems.empty()) throw ConfigError(fmt::format("{}: {}", flag, problems.front().text));
}

/// --hosted and --host.
void HostComponents(const RunChanges& changes, Graph* graph) {
  if (changes.hosted) {
    std::vector<std::string> names;
    for (const ComponentInstance& instance : graph->component()) {
      if (instance.restart()) names.push_back(instance.name());
    }
    if (names.size() < 2) {
      throw ConfigError(fmt::format(
          "--hosted: the graph {} marks fewer than two components restart: true; name them with "
          "--host PROCESS=A,B",
          graph->name()));
    }
    PutInto(kControllerProcess, names, "--hosted", graph);
  }
  for (const std::string& host : changes.host) {
    const std::string flag = "--host " + host;
    const size_t equals = host.find('=');
    const std::string_view parts = std::string_view(host).substr(equals + 1);
    const std::vector<std::string> names = Split(parts, ',');
    if (equals == 0 || equals == std::string::npos || names.size() < 2) {
      throw ConfigError(flag + ": must be PROCESS=A,B: two or more components of the graph");
    }
    PutInto(host.substr(0, equals), names, flag, graph);
  }
}

void AddResource(RunSpec* spec, const std::string& name, const std::string& file,
                 const std::string& text) {
  Resource* resource = spec->add_resource();
  resource->set_name(name);
  resource->set_file(file);
  resource->set_text(text);
}

[[noreturn]] void FailGraph(const std::string& file, const GraphError& error) {
  const GraphFiles files(file);
  std::string lines;
  for (const GraphError::Problem& problem : error.problems()) {
    if (!lines.empty()) lines += "\n";
    lines += files.Line(problem);
  }
  throw ConfigError(lines);
}

/// Ends the program for a Configure that does not return, which nothing else can.
[[noreturn]] void EndHanging(const ComponentInstance& component) {
  fmt::print(stderr, "poise: {} hangs: its Configure has not returned for {} s\n", component.name(),
             kReadyPatience / 1'000'000'000);
  std::fflush(nullptr);
  _exit(1);
}

bool PortsFree(int first, int count) {
  for (int port = first; port < first + count; ++port) {
    const FileDescriptor fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return false;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    if (bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) return false;
  }
  return true;
}

}  // namespace

bool IsThere(const OptionalPort& port, const Scenario& scenario) {
  const auto is_true = [&](const std::string& path) { return IsTrue(scenario, path); };
  return (port.when.empty() || std::ranges::any_of(port.when, is_true)) &&
         std::ranges::none_of(port.unless, is_true);
}

std::string EngineOfField(const std::string& field) {
  const std::string section = field.substr(0, field.find_first_of(".[="));
  const std::vector<std::string> engines = EngineNames();
  return IsAmong(section, engines) ? section : "";
}

RunSpec MakeRunSpec(const LoadedScenario& loaded, const RunChanges& changes) {
  const Scenario& scenario = loaded.scenario;
  RunSpec spec;
  std::random_device random;
  spec.set_run_id(static_cast<int64_t>((uint64_t{random()} << 32 | random()) >> 1));
  spec.set_scenario(NameOf(loaded));
  *spec.mutable_graph() = GraphFiles(loaded.graph_file).Merged();
  ChooseEngine(loaded, spec.mutable_graph());
  CheckEngineOf(changes.set, spec.graph());
  CheckDrivesOf(changes, loaded, spec.graph());
  HostComponents(changes, spec.mutable_graph());
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    ConnectWhere(scenario, spec.mutable_graph()->mutable_component(i), spec.mutable_graph());
  }
  spec.set_tick_period(1 / scenario.tick_rate());
  spec.set_seed(scenario.seed());
  spec.set_lead_ticks(std::llround(scenario.lead() * scenario.tick_rate()));
  spec.set_num_ticks(spec.lead_ticks() + std::max<int64_t>(1, std::llround(scenario.duration() *
                                                                           scenario.tick_rate())));
  WriteConfigs(scenario, &spec);
  const robot::RobotFiles robot = robot::ReadRobotFiles(loaded.robot_file);
  AddResource(&spec, "robot", robot.file, robot.text);
  AddResource(&spec, "urdf", robot.maker_file, robot.maker_text);
  spec.set_realtime(changes.realtime);
  if (changes.priority) spec.mutable_realtime_options()->set_priority(*changes.priority);
  if (changes.cpu) spec.mutable_realtime_options()->set_cpu(*changes.cpu);
  spec.set_drop_rate(changes.drop_rate);
  spec.set_poise_version(PoiseVersion());
  for (const std::string& version : LibraryVersions()) spec.add_library_version(version);
  if (*PoiseCommit() != '\0') spec.set_poise_commit(PoiseCommit());
  spec.set_instruction_set(InstructionSet());
  return spec;
}

BoundGraph ConfigureRun(const LoadedScenario& loaded, RunSpec* spec) {
  CheckSharedProcesses(spec->graph());
  try {
    std::atomic<int> configuring{-1};  // component of the graph; -1: none
    const std::jthread watch = WatchForStall(
        kReadyPatience, [&] { return configuring.load(); },
        [&](int64_t component) {
          EndHanging(spec->graph().component(static_cast<int>(component)));
        });
    BoundGraph graph(*spec, Components(), &configuring);
    FillPlan(graph.plan(), spec->mutable_graph());
    return graph;
  } catch (const GraphError& error) {
    FailGraph(loaded.graph_file, error);
  } catch (const ConfigError& error) {
    if (error.field().empty()) {
      // Where the robot is at fault, its error names the file, which the component's does not.
      robot::LoadRobotFiles(loaded.robot_file);
      throw;
    }
    // The component's own field, below the scenario's field of that component.
    std::string field = error.field();
    for (const ComponentInstance& instance : spec->graph().component()) {
      const std::string& name = instance.name();
      if (field == name || field.starts_with(name + ".")) {
        field =
            ScenarioPath(TypeOf(instance), field.substr(std::min(name.size() + 1, field.size())));
        break;
      }
    }
    FailField(loaded, field, error.problem());
  }
}

std::vector<std::string> WarningsOf(const RunSpec& spec, const BoundGraph& graph) {
  std::vector<std::string> warnings;
  for (int i = 0; i < graph.num_components(); ++i) {
    for (const std::string& text : graph.component(i).wiring.warnings()) {
      warnings.push_back(ScenarioPath(TypeOf(spec.graph().component(i)), text));
    }
  }
  return warnings;
}

RunSetup SetUpRun(const std::string& scenario, const RunChanges& changes) {
  RunSetup setup{LoadScenario(scenario, changes), {}, {}, {}};
  setup.spec = MakeRunSpec(setup.loaded, changes);
  setup.graph = ConfigureRun(setup.loaded, &setup.spec);
  setup.warnings = WarningsOf(setup.spec, *setup.graph);
  return setup;
}

void CheckGraphFile(const std::string& path) {
  const Graph graph = GraphFiles(path).Merged();
  CheckSharedProcesses(graph);
  try {
    CheckGraph(graph, Components());
  } catch (const GraphError& error) {
    FailGraph(path, error);
  }
}

void ChangeConfigurations(const std::vector<std::string>& changes, RunSpec* spec) {
  Graph& graph = *spec->mutable_graph();
  std::map<int, Scenario> changed;  // by component of the graph: its configuration
  for (const std::string& change : changes) {
    const std::string section = change.substr(0, change.find_first_of(".[="));
    const size_t equals = change.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw ConfigError(fmt::format("--set {}: must be field.path=value", change));
    }
    std::vector<std::string> names;
    bool taken = false;
    for (int i = 0; i < graph.component_size(); ++i) {
      const ComponentInstance& instance = graph.component(i);
      const std::vector<std::string> sections = SectionsOf(TypeOf(instance));
      names.insert(names.end(), sections.begin(), sections.end());
      if (!IsAmong(section, sections)) continue;
      if (ConfigField(section) == nullptr) continue;
      taken = true;
      const int config = ConfigIndex(*spec, instance);
      if (config < 0) {
        throw ConfigError(
            fmt::format("--set {}: the run has no configuration of {}", change, instance.name()));
      }
      if (!changed.contains(i)) changed[i] = ReadConfig(spec->config(config), TypeOf(instance));
      try {
        SetField(&changed[i], change.substr(0, equals), change.substr(equals + 1));
      } catch (const ConfigError& error) {
        throw ConfigError(fmt::format("--set {}", error.what()));
      }
    }
    if (!taken) {
      throw ConfigError(
          fmt::format("--set {}: no component of the run has a configuration '{}'; {}", change,
                      section, Suggest(section, names)));
    }
  }
  for (const auto& [i, own] : changed) {
    ComponentInstance* const instance = graph.mutable_component(i);
    spec->mutable_config(ConfigIndex(*spec, *instance))
        ->set_text(ConfigText(own, TypeOf(*instance)));
    ConnectWhere(own, instance, &graph);
  }
}

namespace {

/// Gives the ends of drives what keeps them apart from those of other runs: a port to EtherCAT over
/// UDP, and a tag to a run whose drives are emulated, which so keeps apart from robots, too.
void SeparateDrives(int port, Scenario scenario, RunSpec* spec) {
  // A component has its group of fields also where the scenario says nothing of it.
  for (const ComponentInstance& each : spec->graph().component()) ConfigIn(&scenario, TypeOf(each));
  const std::vector<DriveLink> ends = DriveLinksOf(spec->graph(), scenario);
  const bool emulated = std::ranges::any_of(ends, &DriveLink::drives);
  const auto set = [&](const std::string& field, const std::string& value) {
    if (!HasField(scenario, field)) SetField(&scenario, field, value);
  };
  for (const DriveLink& end : ends) {
    const std::string udp = end.link + ".udp";
    if (!end.link.empty() && HasField(scenario, udp)) set(udp + ".port", std::to_string(port));
    if (!end.tag.empty() && emulated) {
      set(end.tag, fmt::format("poise-{}-{}", spec->run_id(), spec->first_port()));
    }
  }
  if (!ends.empty()) WriteConfigs(scenario, spec);
}

/// Empty: somebody has its port.
std::optional<RunSource> TakeSource(const RunSpec& spec) {
  CheckBusRoute(ServiceUrl(spec));
  try {
    return RunSource(spec);
  } catch (const BusError&) {
    return {};
  }
}

}  // namespace

std::string WhyNotReplayed(const RunSpec& spec, int component) {
  const ComponentInstance& instance = spec.graph().component(component);
  const std::string& type = TypeOf(instance);
  if (IsDescribed(type)) {
    return fmt::format("{} is a program of its own, which no other process holds", type);
  }
  if (Components().Find(type) == nullptr) {
    return fmt::format(
        "this program does not know its type {}: an object of Python's in the place of a "
        "component, or of a module or program whose folder is not on POISE_PATH",
        type);
  }
  const int config = ConfigIndex(spec, instance);
  if (config < 0) return "";
  const Scenario own = ReadConfig(spec.config(config), type);
  const bool drives =
      std::ranges::any_of(Components().TraitsOf(type).drive_links,
                          [&](const DriveLink& end) { return HasField(own, end.group); });
  return drives ? "the log does not hold what passes between bridge and drives" : "";
}

RunSource ChoosePorts(const Scenario& scenario, RunSpec* spec) {
  // The last two: what all send from, EtherCAT over UDP.
  const int count = 4 + spec->graph().channel_size();
  std::mt19937_64 random(static_cast<uint64_t>(spec->run_id()));
  std::uniform_int_distribution<int> first(kFirstPort, kLastPort - count);
  for (int i = 0; i < 200; ++i) {
    const int port = first(random);
    if (!PortsFree(port, count)) continue;
    spec->set_first_port(port);
    std::optional<RunSource> source = TakeSource(*spec);
    if (!source) continue;
    SeparateDrives(port + count - 1, scenario, spec);
    return std::move(*source);
  }
  throw ConfigError(
      fmt::format("no block of {} free UDP ports between {} and {}", count, kFirstPort, kLastPort));
}

}  // namespace poise
