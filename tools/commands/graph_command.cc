#include <algorithm>
#include <filesystem>

#include "components/framework/configuration/configuration.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_style.h"
#include "tools/commands/commands.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/graph_files.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

/// Files are told apart by what they say they are, else by what they hold, whatever folder they lie
/// in.
bool IsScenario(const std::string& file) {
  const std::string message = MessageNamedIn(file);
  if (message == "Scenario" || message == "Graph") return message == "Scenario";
  Scenario scenario;
  try {
    ReadTextProto(file, &scenario);
  } catch (const ConfigError&) {
    try {
      GraphFiles{file};
      return false;
    } catch (const ConfigError&) {
      // Neither parses: the file's folder decides which error is shown.
      return fs::path(file).parent_path().filename() != "graphs";
    }
  }
  return true;
}

void ShowRun(const RunSpec& spec, const BoundGraph& bound) {
  const GraphPlan& plan = bound.plan();
  const auto name_of = [&](const GraphPlan::Endpoint& end) {
    return spec.graph().component(end.component).name();
  };
  // Whoever takes an operator's acts answers them, beside its ports.
  std::string answering;
  for (const GraphPlan::ChannelPlan& channel : plan.channels) {
    if (channel.type != kActType) continue;
    for (const GraphPlan::Endpoint& reader : channel.readers) {
      answering += (answering.empty() ? "" : ", ") + name_of(reader);
    }
  }
  for (const GraphPlan::ChannelPlan& channel : plan.channels) {
    if (channel.type == kAnswerType) {
      fmt::print("  {:<16} {:<18} {:>5} bytes  {} -> (operator)\n", channel.name, channel.type,
                 operate::answer_t{}.getEncodedSize(), answering);
      continue;
    }
    std::string readers;
    for (const GraphPlan::Endpoint& reader : channel.readers) {
      readers += (readers.empty() ? "" : ", ") + name_of(reader);
    }
    fmt::print("  {:<16} {:<18} {:>5} bytes  {} -> {}\n", channel.name, channel.type,
               channel.encoded_size, channel.external ? "(operator)" : name_of(channel.writer),
               readers.empty() ? "(log)" : readers);
  }
  for (const std::string& process : ProcessNames(spec.graph())) {
    const std::vector<int> members = ComponentsOf(spec.graph(), process);
    if (members.size() < 2) continue;
    fmt::print("process {}:", process);
    for (const int member : members) fmt::print(" {}", spec.graph().component(member).name());
    fmt::print("\n");
  }
  std::string tick = "one tick:";
  for (const GraphPlan::StageRef& ref : plan.order) {
    const ConfiguredComponent& component = bound.component(ref.component);
    tick += fmt::format(" {}.{}", component.name,
                        component.wiring.stages()[static_cast<size_t>(ref.stage)].name);
  }
  fmt::print("{}", ScreenLines(2, "{}", tick));
}

struct GraphOptions {
  std::string name = "push_double_support";
};

int CheckByName(const GraphOptions& options) {
  const std::string file =
      FindFileOfKinds({"scenarios", "graphs"}, options.name, fs::current_path()).string();
  if (!IsScenario(file)) {
    CheckGraphFile(file);
    fmt::print(
        "{}: names, types and connections are good; check a scenario to have the "
        "configurations checked too\n",
        file);
    return kExitOk;
  }
  const RunSetup setup = SetUpRun(file, {});
  const LoadedScenario& loaded = setup.loaded;
  const RunSpec& spec = setup.spec;
  std::vector<std::string> warnings = setup.warnings;
  std::string variants;
  std::string problems;
  for (const Variant& variant : loaded.scenario.variant()) {
    RunChanges changes;
    changes.variant = variant.name();
    try {
      for (const std::string& text : SetUpRun(file, changes).warnings) {
        if (std::ranges::find(warnings, text) != warnings.end()) continue;
        warnings.push_back(fmt::format("variant {}: {}", variant.name(), text));
      }
      variants += ", " + variant.name();
    } catch (const std::runtime_error& error) {
      // One of a base may not fit what is run: the others are told of all the same.
      problems += fmt::format("variant {}: {}\n", variant.name(), error.what());
    }
  }
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  const std::string verdict = warnings.empty()
                                  ? "all good"
                                  : fmt::format("good but for {} warning{}", warnings.size(),
                                                warnings.size() == 1 ? "" : "s");
  fmt::print("{} with {}: {} components, {} channels, {}{}\n", loaded.files.file(),
             loaded.graph_file, spec.graph().component_size(), spec.graph().channel_size(), verdict,
             variants.empty() ? "" : "; variants too: " + variants.substr(2));
  ShowRun(spec, *setup.graph);
  if (problems.empty()) return kExitOk;
  fmt::print(stderr, "poise: {}", problems);
  return kExitUsage;
}

}  // namespace

void AddGraphCommand(CLI::App* app, Command* command) {
  CLI::App* const graph = AddGroup(app, "graph", "look at process graphs");
  const auto [check, options] = AddCommand<GraphOptions>(
      graph, command, "check",
      "check a graph, or a scenario with its graph, robot and configurations", CheckByName);
  check->add_option("name", options->name, "graph or scenario: a name or a .pbtxt file")
      ->capture_default_str();
  SetExample(check, "poise graph check push_double_support");
}

}  // namespace poise
