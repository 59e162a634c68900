#include <algorithm>
#include <functional>
#include <memory>

#include "components/framework/configuration.h"
#include "components/robot/robot.pb.h"
#include "deploy/poise/catalog.h"
#include "deploy/poise/commands.h"
#include "deploy/poise/registry.h"
#include "deploy/poise/scenario_files.h"
#include "deploy/poise/sweep.pb.h"
#include "fmt/format.h"
#include "logging/metrics.h"

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
      text = describe((DeployDir() / kind / (name + ".pbtxt")).string());
    } catch (const ConfigError& error) {
      text = error.what();
    }
    fmt::print("  {:<{}}  {}\n", name, width, text);
  }
}

int List(const std::string& what) {
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
      for (const Variant& variant : s.variant()) {
        text += fmt::format("\n      --variant {}: {}{}", variant.name(), variant.description(),
                            variant.name() == s.reference() ? " (the reference)" : "");
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
    ListFiles("robots",
              [](const std::string& file) { return "URDF " + ReadMessage<Robot>(file).urdf(); });
  }
  if (wanted("graphs")) {
    ListFiles("graphs", [](const std::string& file) {
      const Graph g = ReadMessage<Graph>(file);
      return fmt::format("{} ({} components, {} channels)", g.description(), g.component_size(),
                         g.channel_size());
    });
  }
  if (wanted("components")) {
    for (const auto& [type, entry] : Components().entries()) {
      fmt::print("  {:<24}{}\n", type, entry.summary);
    }
  }
  if (wanted("metrics")) {
    for (const logging::Metric& metric : logging::Metrics()) {
      fmt::print("  {:<28}{:<6}{}\n", metric.name, metric.unit, metric.description);
    }
  }
  return kExitOk;
}

}  // namespace

void AddListCommand(CLI::App* app, Command* command) {
  auto what = std::make_shared<std::string>();
  CLI::App* list = app->add_subcommand("list", "what there is to use");
  list->add_option("what", *what,
                   "scenarios, sweeps, robots, graphs, components or metrics; default: all")
      ->check(CLI::IsMember({"scenarios", "sweeps", "robots", "graphs", "components", "metrics"}));
  list->callback([what, command] { *command = [what] { return List(*what); }; });
}

}  // namespace poise
