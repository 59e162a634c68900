#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/optional_ports.h"
#include "components/robot_files/robot.pb.h"
#include "derived/message_traits.hpp"
#include "fmt/format.h"
#include "logging/derived/tick_messages.h"
#include "logging/metrics/metric_needs.h"
#include "logging/metrics/metrics.h"
#include "logging/printable.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_style.h"
#include "tools/commands/commands.h"
#include "tools/reference/reference_text.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_index.h"
#include "tools/run/run_registry.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/graph_files.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/scenario_files.h"
#include "tools/sweep/sweep.pb.h"

namespace poise {
namespace {

template <class Message>
Message ReadMessage(const std::string& file) {
  Message message;
  ReadTextProto(file, &message);
  return message;
}

/// One line a file: its name and what `describe` says of it; a ConfigError is shown instead.
void ListFiles(const std::string& kind,
               const std::function<std::string(const std::string& file)>& describe) {
  const std::vector<std::string> names = ListNames(kind);
  size_t width = 0;
  for (const std::string& name : names) width = std::max(width, name.size());
  for (const std::string& name : names) {
    std::string text;
    try {
      text = describe(InstalledFile(kind, name).string());
    } catch (const ConfigError& error) {
      text = error.what();
    }
    fmt::print("{}", ScreenLines(6, "  {:<{}}  {}", name, width, text));
  }
}

/// What the command line asks of the list.
struct ListRequest {
  std::string what;
  std::string name;
  std::string schema = "scenario";
  bool markdown = false;
  bool folders = false;
  bool json = false;
};

size_t TextWidth() { return static_cast<size_t>(std::min(ScreenStyle().columns, 100)); }

ChannelsByType GraphChannels() {
  ChannelsByType channels;
  for (const std::string& name : ListNames("graphs")) {
    const Graph graph = GraphFiles(InstalledFile("graphs", name).string()).Merged();
    for (const Channel& channel : graph.channel()) {
      std::vector<std::string>& names = channels[channel.type()];
      if (!IsAmong(channel.name(), names)) {
        names.push_back(channel.name());
      }
    }
  }
  channels[MessageTraits<derived::signals_t>::kName] = {logging::kDerivedChannel};
  return channels;
}

int ListFields(const ListRequest& request) {
  static const std::map<std::string, Schema> kSchemas = {{"scenario", Schema::kScenario},
                                                         {"robot", Schema::kRobot},
                                                         {"sweep", Schema::kSweep},
                                                         {"graph", Schema::kGraph}};
  const auto fields = SelectFields(FieldReference(kSchemas.at(request.schema)), request.name);
  if (request.markdown) {
    fmt::print("{}", FieldsAsMarkdown(fields));
  } else if (request.name.empty()) {
    fmt::print("{}\n`poise list fields NAME` tells of those of a name, or with a part of one.\n",
               FieldIndex(fields, TextWidth()));
  } else {
    fmt::print("{}", FieldsAsText(fields, TextWidth()));
  }
  return kExitOk;
}

int ListMessages(const ListRequest& request) {
  const std::vector<MessageEntry> messages = MessageReference();
  const ChannelsByType channels = GraphChannels();
  if (request.name.empty()) {
    fmt::print("{}", request.markdown ? MessagesAsMarkdown(messages, channels)
                                      : MessagesAsText(messages, channels, TextWidth()));
    return kExitOk;
  }
  std::string type = request.name;
  for (const auto& [carried, names] : channels) {
    if (IsAmong(request.name, names)) type = carried;
  }
  const MessageEntry& message = FindMessage(messages, type);
  fmt::print("{}", request.markdown ? MessagesAsMarkdown({message}, channels)
                                    : MessageAsText(messages, message, channels, TextWidth()));
  return kExitOk;
}

int ListMetricsAsMarkdown() {
  fmt::print("| metric | unit | meaning | computed from |\n|---|---|---|---|\n");
  for (const logging::Metric& metric : logging::Metrics()) {
    fmt::print("| `{}` | {} | {} | {} |\n", metric.name, metric.unit, metric.description,
               fmt::join(logging::TellNeeds(metric), "; "));
  }
  return kExitOk;
}

/// One metric, or those whose name holds a word, with what each is computed from.
int ListMetric(const std::string& name) {
  const auto print = [](const logging::Metric& metric) {
    fmt::print("{}{}\n{}", metric.name, metric.unit.empty() ? "" : ", " + metric.unit,
               ScreenLines(2, "  {}", metric.description));
    for (const std::string& need : logging::TellNeeds(metric)) {
      fmt::print("{}", ScreenLines(7, "  from {}", need));
    }
  };
  if (const logging::Metric* const metric = logging::FindMetric(name)) {
    print(*metric);
    return kExitOk;
  }
  bool found = false;
  for (const logging::Metric& metric : logging::Metrics()) {
    if (metric.name.find(name) == std::string::npos) continue;
    print(metric);
    found = true;
  }
  if (!found) throw ConfigError(logging::NoMetric(name));
  return kExitOk;
}

/// Folders alone, of runs that can be listened to: for scripts.
void ListRunFolders() {
  for (const RunningRun& run : RunningRuns()) {
    if (run.own && run.networked) fmt::print("{}\n", run.dir.string());
  }
}

/// The runs that have left a folder below runs/.
void ListPastRuns(bool json) {
  const std::vector<PastRun> runs = PastRuns();
  if (json) {
    auto list = nlohmann::ordered_json::array();
    for (const PastRun& run : runs) {
      list.push_back({{"folder", run.dir.string()},
                      {"started_at", run.started_at},
                      {"robot", run.robot},
                      {"scenario", run.scenario},
                      {"outcome", run.outcome},
                      {"flags", run.flags},
                      {"bytes", run.bytes}});
    }
    KeepUnicode();
    fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  } else if (!runs.empty()) {
    fmt::print("  of {}:\n{}", logging::ForTerminal(RunsDir().string()), FormatPastRuns(runs));
  }
}

void ListRuns() {
  const std::vector<RunningRun> runs = RunningRuns();
  fmt::print("{}", runs.empty() ? "  none is going on\n" : FormatRuns(runs));
  const std::string ended = LatestEndedRun().string();
  if (!ended.empty()) fmt::print("  the latest that ended: {}\n", logging::ForTerminal(ended));
}

/// Name, unit and meaning in columns; where these leave little room, the meaning below.
void PrintMetrics() {
  constexpr int kLeastRoom = 26;
  int name = 0;
  int unit = 0;
  for (const logging::Metric& metric : logging::Metrics()) {
    name = std::max(name, DisplayWidth(metric.name));
    unit = std::max(unit, DisplayWidth(metric.unit));
  }
  const int indent = 2 + name + 2 + unit + 2;
  const bool room = ScreenStyle().columns - indent >= kLeastRoom;
  for (const logging::Metric& metric : logging::Metrics()) {
    fmt::print("{}", room ? ScreenLines(indent, "  {:<{}}  {:<{}}  {}", metric.name, name,
                                        metric.unit, unit, metric.description)
                          : fmt::format("  {}  {}\n", metric.name, metric.unit) +
                                ScreenLines(6, "      {}", metric.description));
  }
}

/// Ports and settings of one type.
int ListComponent(const std::string& name) {
  const ComponentType* const type = Components().TypeNamed(name);
  if (type == nullptr) {
    std::vector<std::string> names;
    for (const auto& [other, entry] : Components().entries()) names.push_back(other);
    throw ConfigError(
        fmt::format("there is no component '{}'; {}", name, Suggest(name, std::move(names))));
  }
  fmt::print("{}: {}\n", type->name, type->summary);
  const auto print = [](bool input, const std::string& port, const std::string& carried,
                        InputKind kind, const std::string& where) {
    const char* const when = kind == InputKind::kPreviousTick ? ", of the tick before"
                             : kind == InputKind::kLatest     ? ", the latest"
                                                              : "";
    fmt::print("{}", ScreenLines(29, "  {:<7} {:<18} {}{}{}{}", input ? "input" : "output", port,
                                 carried, when, where.empty() ? "" : ", ", where));
  };
  for (const bool input : {true, false}) {
    for (const PortType& port : type->ports) {
      if (port.input == input) print(input, port.name, port.type, port.kind, "");
    }
    for (const OptionalPort& port : OptionalPortsOf(type->name)) {
      if (port.input == input) print(input, port.port, port.type, port.kind, WhereText(port));
    }
  }
  if (type->config == nullptr || type->schema == nullptr) return kExitOk;
  AddSchema(type->schema());
  const std::vector<std::string>& sections = type->traits.sections;
  const std::string prefix =
      sections.size() > 1 ? "" : (sections.empty() ? name : sections[0]) + ".";
  fmt::print("\n{}", FieldsAsText(FieldsOfType(type->config->full_name(), prefix), TextWidth()));
  return kExitOk;
}

int List(const ListRequest& request) {
  const std::string& what = request.what;
  if (request.folders) {
    if (what != "runs") throw ConfigError("--folders goes with `poise list runs`");
    ListRunFolders();
    return kExitOk;
  }
  if (request.json && what != "runs") throw ConfigError("--json goes with `poise list runs`");
  if (request.markdown) KeepUnicode();
  if (what == "fields") return ListFields(request);
  if (what == "messages") return ListMessages(request);
  if (what == "components" && !request.name.empty()) return ListComponent(request.name);
  if (what == "metrics" && !request.name.empty()) return ListMetric(request.name);
  if (!request.name.empty()) {
    throw ConfigError("NAME goes with `poise list fields`, `messages`, `components` and `metrics`");
  }
  if (request.markdown) {
    if (what == "metrics") return ListMetricsAsMarkdown();
    throw ConfigError("--markdown goes with fields, messages and metrics");
  }
  const auto wanted = [&](const char* kind) {
    const bool all = what.empty();
    if (all) fmt::print("{}\n", kind);
    return all || what == kind;
  };
  if (wanted("scenarios")) {
    ListFiles("scenarios", [](const std::string& file) {
      const Scenario s = ScenarioFiles(file).Merged();
      std::string text =
          fmt::format("{} ({} s{})", s.description(), s.duration(),
                      s.has_paper_section() ? ", paper section " + s.paper_section() : "");
      // What a variant of the base says of itself need not be true here.
      const auto own = ReadMessage<Scenario>(file);
      const std::vector<std::string> described = NamesOf(own.variant());
      std::string inherited;
      for (const Variant& variant : s.variant()) {
        if (!IsAmong(variant.name(), described)) {
          inherited += (inherited.empty() ? "" : ", ") + variant.name();
          continue;
        }
        text += fmt::format("\n      --variant {}: {}{}", variant.name(), variant.description(),
                            variant.name() == s.reference() ? " (the reference)" : "");
      }
      if (!inherited.empty()) {
        text += fmt::format("\n      of its base {}, described there: {}", own.base(), inherited);
      }
      return text;
    });
  }
  if (wanted("sweeps")) {
    ListFiles("sweeps", [](const std::string& file) {
      const auto sweep = ReadMessage<Sweep>(file);
      return fmt::format("{} (poise {}, scenario {})", sweep.description(),
                         sweep.has_limit() ? "limit" : "sweep", sweep.scenario());
    });
  }
  if (wanted("robots")) {
    ListFiles("robots", [](const std::string& file) {
      const Robot robot = ReadMessage<Robot>(file);
      const std::string name = robot.has_mjcf() ? robot.mjcf() : robot.urdf();
      std::error_code error;
      return fmt::format(
          "{} {}{}", robot.has_mjcf() ? "MJCF" : "URDF", name,
          std::filesystem::exists(std::filesystem::path(file).parent_path() / name, error)
              ? ""
              : fmt::format(", which is not here: {} says where it is from", file));
    });
  }
  if (wanted("graphs")) {
    ListFiles("graphs", [](const std::string& file) {
      const Graph g = GraphFiles(file).Merged();
      return fmt::format("{} ({} components, {} channels)", g.description(), g.component_size(),
                         g.channel_size());
    });
  }
  if (wanted("components")) {
    for (const auto& [type, entry] : Components().entries()) {
      const std::vector<std::string>& sections = entry.traits.sections;
      const std::string fields = sections.empty() ? ""
                                                  : fmt::format(" (the scenario's fields {})",
                                                                fmt::join(sections, " and "));
      fmt::print("{}", ScreenLines(26, "  {:<24}{}{}", type, entry.summary, fields));
    }
  }
  if (wanted("runs") && !request.json) ListRuns();
  if (what == "runs") ListPastRuns(request.json);
  if (wanted("metrics")) {
    PrintMetrics();
  }
  if (what.empty()) {
    fmt::print(
        "\npoise list fields [NAME]: the fields of a scenario with type, default, unit and "
        "meaning\n"
        "poise list messages: every message of the bus\n");
  }
  return kExitOk;
}

}  // namespace

void AddListCommand(CLI::App* app, Command* command) {
  const auto [list, request] = AddCommand<ListRequest>(
      app, command, "list", "what there is to use, and what each field means", List);
  list->add_option(
          "what", request->what,
          "scenarios, sweeps, robots, graphs, components, runs (that go on, and those that "
          "have left a folder below runs/), metrics, fields or messages; default: all but the last "
          "two")
      ->check(CLI::IsMember({"scenarios", "sweeps", "robots", "graphs", "components", "runs",
                             "metrics", "fields", "messages"}));
  list->add_option("name", request->name,
                   "of fields: a path or its beginning (sim.push), or a part of a field's "
                   "name (stiffness); of messages: a type or a channel (ROBOT_STATE); of "
                   "components: a type, whose ports and settings are shown; of metrics: one, or a "
                   "part of its name: what it is computed from");
  list->add_option("--schema", request->schema, "of fields: whose; default: scenario")
      ->check(CLI::IsMember({"scenario", "robot", "sweep", "graph"}));
  list->add_flag("--markdown", request->markdown, "fields, messages or metrics as Markdown");
  list->add_flag("--folders", request->folders,
                 "of runs: only the folders of those that can be listened to, for scripts");
  list->add_flag("--json", request->json, "of runs: those below runs/, for programs");
  SetExample(list, "poise list fields sim.push");
}

}  // namespace poise
