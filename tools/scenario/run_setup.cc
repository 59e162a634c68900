#include "tools/scenario/run_setup.h"

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "components/framework/build_info.h"
#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "components/framework/suggest.h"
#include "components/robot/robot.pb.h"
#include "components/robot/robot_files.h"
#include "fmt/format.h"
#include "hw_bridge/drive_emulator/drive_emulator.pb.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "tools/scenario/library_versions.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

// Below the ephemeral ports that the system gives to sockets of its own choice.
constexpr int kFirstPort = 12000;
constexpr int kLastPort = 32000;

/// The scenario's field with the configuration of a component; nullptr when it has none of that
/// name.
const google::protobuf::FieldDescriptor* ConfigField(const Scenario& scenario,
                                                     const std::string& component) {
  const auto* field = scenario.GetDescriptor()->FindFieldByName(component);
  const bool is_config = field != nullptr && !field->is_repeated() &&
                         field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE;
  return is_config ? field : nullptr;
}

std::string ConfigText(const Scenario& scenario, const std::string& component) {
  const auto* field = ConfigField(scenario, component);
  if (field == nullptr || !scenario.GetReflection()->HasField(scenario, field)) return "";
  std::string text;
  google::protobuf::TextFormat::PrintToString(scenario.GetReflection()->GetMessage(scenario, field),
                                              &text);
  return text;
}

void AddResource(RunSpec* spec, const std::string& name, const fs::path& file) {
  Resource* resource = spec->add_resource();
  resource->set_name(name);
  resource->set_file(file.string());
  resource->set_text(ReadFile(file.string()));
}

/// "file:line: field: problem" of a problem in a graph's file.
std::string GraphLine(const std::string& file, const std::string& text,
                      const GraphError::Problem& problem) {
  const int line = LocateField(text, problem.field, Graph());
  const std::string where = line > 0 ? fmt::format("{}:{}", file, line) : file;
  return problem.field.empty() ? fmt::format("{}: {}", where, problem.text)
                               : fmt::format("{}: {}: {}", where, problem.field, problem.text);
}

[[noreturn]] void FailGraph(const std::string& file, const GraphError& error) {
  const std::string text = ReadFile(file);
  std::string lines;
  for (const GraphError::Problem& problem : error.problems()) {
    if (!lines.empty()) lines += "\n";
    lines += GraphLine(file, text, problem);
  }
  throw ConfigError(lines);
}

bool PortsFree(int first, int count) {
  for (int port = first; port < first + count; ++port) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return false;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    const bool free = bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    close(fd);
    if (!free) return false;
  }
  return true;
}

}  // namespace

RunSpec MakeRunSpec(const LoadedScenario& loaded, const RunChanges& changes,
                    std::vector<std::string>* warnings) {
  const Scenario& scenario = loaded.scenario;
  RunSpec spec;
  std::random_device random;
  spec.set_run_id(static_cast<int64_t>((uint64_t{random()} << 32 | random()) >> 1));
  spec.set_scenario(NameOf(loaded));
  ReadTextProto(loaded.graph_file, spec.mutable_graph());
  spec.set_tick_period(1 / scenario.tick_rate());
  spec.set_seed(scenario.seed());
  spec.set_lead_ticks(std::llround(scenario.lead() * scenario.tick_rate()));
  spec.set_num_ticks(spec.lead_ticks() + std::max<int64_t>(1, std::llround(scenario.duration() *
                                                                           scenario.tick_rate())));
  for (const ComponentInstance& instance : spec.graph().component()) {
    ComponentConfig* config = spec.add_config();
    config->set_component(instance.name());
    config->set_text(ConfigText(scenario, TypeOf(instance)));
  }
  Robot robot;
  ReadTextProto(loaded.robot_file, &robot);
  if (!robot.has_urdf()) {
    throw ConfigError(
        fmt::format("{}: urdf: is missing; name the robot's URDF, relative to this "
                    "file",
                    loaded.robot_file));
  }
  robot::LoadRobotFiles(loaded.robot_file, warnings);
  AddResource(&spec, "robot", loaded.robot_file);
  AddResource(&spec, "urdf", fs::path(loaded.robot_file).parent_path() / robot.urdf());
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

void CheckRun(const LoadedScenario& loaded, RunSpec* spec) {
  try {
    CheckGraph(spec->graph(), Components());
    const BoundGraph bound(*spec, Components());
    FillCounts(bound.plan(), spec->mutable_graph());
  } catch (const GraphError& error) {
    FailGraph(loaded.graph_file, error);
  } catch (const ConfigError& error) {
    // The component's own field, below the scenario's field of that component.
    if (error.field().empty()) throw;
    std::string field = error.field();
    for (const ComponentInstance& instance : spec->graph().component()) {
      if (field == instance.name() || field.starts_with(instance.name() + ".")) {
        field.replace(0, instance.name().size(), TypeOf(instance));
        break;
      }
    }
    FailField(loaded, field, error.problem());
  }
}

void CheckGraphFile(const std::string& path) {
  Graph graph;
  ReadTextProto(path, &graph);
  try {
    CheckGraph(graph, Components());
  } catch (const GraphError& error) {
    FailGraph(path, error);
  }
}

void ChangeConfiguration(const std::string& change, RunSpec* spec) {
  const std::string type = change.substr(0, change.find_first_of(".[="));
  std::vector<std::string> types;
  bool changed = false;
  const size_t equals = change.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ConfigError(fmt::format("--set {}: must be field.path=value", change));
  }
  for (const ComponentInstance& instance : spec->graph().component()) {
    types.push_back(TypeOf(instance));
    Scenario scenario;
    const auto* field = ConfigField(scenario, type);
    if (types.back() != type || field == nullptr) continue;
    auto& configs = *spec->mutable_config();
    auto config = std::find_if(configs.begin(), configs.end(), [&](const ComponentConfig& c) {
      return c.component() == instance.name();
    });
    if (config == configs.end()) {
      throw ConfigError(
          fmt::format("--set {}: the run has no configuration of {}", change, instance.name()));
    }
    ParseTextProto(config->text(), "configuration of " + instance.name(),
                   scenario.GetReflection()->MutableMessage(&scenario, field));
    try {
      SetField(&scenario, change.substr(0, equals), change.substr(equals + 1));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("--set {}", error.what()));
    }
    config->set_text(ConfigText(scenario, type));
    changed = true;
  }
  if (!changed) {
    throw ConfigError(fmt::format("--set {}: the run has no component '{}'; {}", change, type,
                                  Suggest(type, types)));
  }
}

namespace {

/// The port of EtherCAT over UDP, for the components at both of its ends.
void SetEthercatPort(int port, RunSpec* spec) {
  for (ComponentConfig& config : *spec->mutable_config()) {
    const auto& components = spec->graph().component();
    const auto instance = std::find_if(
        components.begin(), components.end(),
        [&](const ComponentInstance& each) { return each.name() == config.component(); });
    if (instance == components.end()) continue;
    const auto set = [&](auto message, auto link_of) {
      ParseTextProto(config.text(), "configuration of " + config.component(), &message);
      ethercat::LinkConfig* const link = link_of(&message);
      if (link == nullptr || !link->has_udp() || link->udp().has_port()) return;
      link->mutable_udp()->set_port(static_cast<uint32_t>(port));
      google::protobuf::TextFormat::PrintToString(message, config.mutable_text());
    };
    if (TypeOf(*instance) == "hw_bridge") {
      set(HwBridgeConfig(), [](HwBridgeConfig* message) {
        return message->has_ethercat() ? message->mutable_ethercat()->mutable_link() : nullptr;
      });
    } else if (TypeOf(*instance) == "drive_emulator") {
      set(DriveEmulatorConfig(),
          [](DriveEmulatorConfig* message) { return message->mutable_link(); });
    }
  }
}

}  // namespace

bool SpeaksEthercat(const RunSpec& spec, int component) {
  const ComponentInstance& instance = spec.graph().component(component);
  if (TypeOf(instance) == "drive_emulator") return true;
  if (TypeOf(instance) != "hw_bridge") return false;
  for (const ComponentConfig& config : spec.config()) {
    if (config.component() != instance.name()) continue;
    HwBridgeConfig bridge;
    ParseTextProto(config.text(), "configuration of " + instance.name(), &bridge);
    return bridge.has_ethercat();
  }
  return false;
}

void ChoosePorts(RunSpec* spec) {
  const int count = 3 + spec->graph().channel_size();  // the last one: EtherCAT over UDP
  std::mt19937_64 random(static_cast<uint64_t>(spec->run_id()));
  std::uniform_int_distribution<int> first(kFirstPort, kLastPort - count);
  for (int i = 0; i < 200; ++i) {
    const int port = first(random);
    if (!PortsFree(port, count)) continue;
    spec->set_first_port(port);
    SetEthercatPort(port + count - 1, spec);
    return;
  }
  throw ConfigError(
      fmt::format("no block of {} free UDP ports between {} and {}", count, kFirstPort, kLastPort));
}

}  // namespace poise
