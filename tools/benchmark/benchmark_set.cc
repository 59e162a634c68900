#include "tools/benchmark/benchmark_set.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/run.h"
#include "components/robot/dynamics.h"
#include "components/robot/sole.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "sim/start_posture.h"
#include "tools/cli/output_place.h"
#include "tools/scenario/based_files.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/graph_files.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/scenario_files.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using google::protobuf::FieldDescriptor;

constexpr char kGraph[] = "balance";    // Poise's own
constexpr char kGraphFile[] = "graph";  // of a folder that Write made
constexpr char kEnding[] = ".pbtxt";

bool IsName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(),
                                      [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

/// The scenario's groups that are a controller's: those of no engine and of no emulated drive.
std::set<std::string> ControllerFields() {
  std::set<std::string> own = {"graph"}, others = {"sim"};
  for (const auto& [type, entry] : Components().entries()) {
    const ComponentTraits& traits = entry.traits;
    const bool drives = std::any_of(traits.drive_links.begin(), traits.drive_links.end(),
                                    [](const DriveLink& end) { return end.drives; });
    const bool plant = drives || !traits.engine.empty();
    std::set<std::string>& names = plant ? others : own;
    if (traits.sections.empty()) names.insert(type);
    names.insert(traits.sections.begin(), traits.sections.end());
  }
  for (const std::string& name : others) own.erase(name);
  return own;
}

void CheckField(const std::string& where, const std::string& field) {
  static const std::set<std::string> allowed = ControllerFields();
  if (allowed.contains(field)) return;
  throw ConfigError(fmt::format(
      "{}: {} is the benchmark's, the same for all; a controller gives its graph and the fields of "
      "its components: {}",
      where, field, fmt::join(allowed, ", ")));
}

/// The set of a file: its base's, and what the file adds to that and changes.
Benchmark ReadSet(const fs::path& file) {
  Benchmark merged;
  for (const BasedFile<Benchmark>& own :
       ReadWithBases<Benchmark>(file, "benchmarks", BaseFiles::kRefused,
                                [](const auto&... given) { ParseTextProto(given...); })) {
    merged.MergeFrom(own.fields);
    for (int i = 0; i < own.fields.set_size(); ++i) {
      const std::string& change = own.fields.set(i);
      const size_t equals = change.find('=');
      const std::string place = fmt::format("set[{}]", i);
      if (equals == std::string::npos) own.Fail(place, "write FIELD=VALUE");
      try {
        SetField(&merged, change.substr(0, equals), change.substr(equals + 1));
      } catch (const ConfigError& error) {
        own.Fail(place, error.what());
      }
    }
  }
  merged.clear_base();
  merged.clear_set();
  return merged;
}

void CheckSet(const Benchmark& benchmark, const std::string& file) {
  const auto fail = [&](const std::string& problem) {
    throw ConfigError(fmt::format("{}: {}", file, problem));
  };
  if (!IsName(benchmark.name())) fail("name: use letters, digits and _");
  if (benchmark.part_size() == 0) fail("part: is missing");
  std::set<std::string> names;
  for (const BenchmarkPart& part : benchmark.part()) {
    if (!IsName(part.name()) || !names.insert(part.name()).second) {
      fail(fmt::format("part: '{}' is no name, or another part's", part.name()));
    }
    const std::string where = "part " + part.name();
    if (!part.has_scenario() || !part.has_sweep()) fail(where + ": needs scenario and sweep");
    if (part.scenario().has_graph() || part.scenario().has_robot() || part.sweep().has_scenario()) {
      fail(where + ": graph, robot and the sweep's scenario are not the set's");
    }
    try {
      RequireFields(part, {"quick"}, where + ": ");
      CheckFields(part, where + ": ");
    } catch (const ConfigError& error) {
      fail(error.what());
    }
  }
}

BenchmarkRobot ReadBenchmarkRobot(const std::string& name) {
  BenchmarkRobot robot;
  robot.name = name;
  robot.file = FindFile("robots", name, fs::current_path()).string();
  const robot::RobotFiles files = robot::ReadRobotFiles(robot.file);
  robot.maker_file = files.maker_file;
  const robot::RobotModel model = files.Model();
  const robot::RobotState start = SolveStart(model, StartPosture());
  const robot::RobotData data = robot::Evaluate(model, start);
  constexpr size_t kLeft = 1;
  const Eigen::Vector3d left = data.foot_pose[kLeft].translation();
  robot.mass = model.total_mass();
  robot.height = data.com.z() - std::min(left.z(), data.foot_pose[0].translation().z());
  robot.left_x = left.x();
  robot.left_y = left.y();
  Eigen::Vector2d low = Eigen::Vector2d::Constant(HUGE_VAL), high = -low;
  for (const Eigen::Vector2d& corner : robot::SoleCorners(model.feet()[kLeft])) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  robot.sole_length = (high - low).x();
  robot.sole_width = (high - low).y();
  return robot;
}

}  // namespace

std::vector<Constant> BenchmarkRobot::constants() const {
  std::vector<Constant> all;
  for (const auto& [name, value] :
       {std::pair{"robot_mass", mass}, std::pair{"robot_height", height},
        std::pair{"robot_left_x", left_x}, std::pair{"robot_left_y", left_y},
        std::pair{"robot_sole_length", sole_length}, std::pair{"robot_sole_width", sole_width}}) {
    Constant& constant = all.emplace_back();
    constant.set_name(name);
    constant.set_value(value);
  }
  return all;
}

BenchmarkSet::BenchmarkSet(const std::string& name, const BenchmarkSubject& subject)
    : subject_(subject) {
  const std::string file = FindFile("benchmarks", name, fs::current_path()).string();
  benchmark_ = ReadSet(file);
  CheckSet(benchmark_, file);
  text_ = TextOf(benchmark_);
  robot_ = ReadBenchmarkRobot(subject.changes.robot);
  ReadController();
}

void BenchmarkSet::ReadController() {
  fs::path graph_beside = fs::current_path();
  if (!subject_.controller.empty()) {
    const fs::path file = FindFile("scenarios", subject_.controller, fs::current_path());
    const ScenarioFiles files{file};
    controller_ = files.Merged();
    std::vector<const FieldDescriptor*> fields;
    controller_.GetReflection()->ListFields(controller_, &fields);
    for (const FieldDescriptor* field : fields) {
      // Words about it, and checks, measure nothing.
      const std::string& what = field->name();
      if (what == "name" || what == "description" || what == "variant") continue;
      CheckField(file.string(), what);
    }
    for (const Variant& variant : controller_.variant()) {
      for (const std::string& change : variant.set()) {
        CheckField(fmt::format("{}: variant {}", file.string(), variant.name()),
                   change.substr(0, change.find_first_of(".[=")));
      }
    }
    graph_beside = files.FolderOf("graph");
  }
  for (const std::string& change : subject_.changes.set) {
    CheckField("--set " + change, change.substr(0, change.find_first_of(".[=")));
  }
  std::string graph = subject_.graph;
  if (!graph.empty()) {
    graph_beside = fs::current_path();
  } else {
    graph = controller_.has_graph() ? controller_.graph() : std::string(kGraph);
  }
  if (graph.empty()) graph = kGraph;
  if (!subject_.changes.drives.empty() && graph != kGraph) {
    throw ConfigError("--drives: brings a graph of its own; leave the graph out");
  }
  const Graph merged = GraphFiles(FindFile("graphs", graph, graph_beside).string()).Merged();
  graph_text_ = TextOf(merged);
  engine_ = subject_.changes.world.empty() ? EngineOf(merged) : subject_.changes.world;
  controller_.clear_graph();
  controller_.clear_name();
  controller_.clear_description();
}

void BenchmarkSet::Write(const fs::path& folder) const {
  fs::create_directories(folder);
  // --drives puts its own in the place of Poise's.
  const bool own_graph = subject_.changes.drives.empty();
  if (own_graph) WriteFile(folder / (std::string(kGraphFile) + kEnding), graph_text_);
  for (const BenchmarkPart& part : benchmark_.part()) {
    const std::string scenario_name = part.name() + "_scenario";
    Scenario scenario = part.scenario();
    scenario.set_name(part.name());
    scenario.set_robot("dyros/dyros_legs");  // which --robot replaces
    if (own_graph) scenario.set_graph(kGraphFile);
    scenario.MergeFrom(controller_);
    Sweep sweep = part.sweep();
    sweep.set_name(part.name());
    sweep.set_description(part.title());
    sweep.set_scenario(scenario_name);
    WriteFile(folder / (scenario_name + kEnding),
              fmt::format("# proto-file: tools/scenario/scenario.proto\n# proto-message: "
                          "poise.Scenario\n{}",
                          TextOf(scenario)));
    WriteFile(folder / (part.name() + kEnding),
              fmt::format("# proto-file: tools/sweep/sweep.proto\n# proto-message: poise.Sweep\n{}",
                          TextOf(sweep)));
  }
}

SweepDefinition BenchmarkSet::Definition(int i, const fs::path& folder) const {
  const BenchmarkPart& part = benchmark_.part(i);
  SweepArguments arguments;
  arguments.what = (folder / (part.name() + kEnding)).string();
  arguments.constant = robot_.constants();
  arguments.changes = subject_.changes;
  arguments.changes.robot = robot_.file;
  return SweepDefinition(arguments, part.sweep().has_limit());
}

std::vector<int64_t> BenchmarkPoints(const BenchmarkPart& part, int64_t size, bool quick) {
  const int64_t count = quick ? std::min<int64_t>(part.quick(), size) : size;
  std::vector<int64_t> points;
  for (int64_t i = 0; i < count; ++i) points.push_back(i * size / count);
  return points;
}

}  // namespace poise
