// `poise ladder`: how much of a push each rung between physics and the robot survives.
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tools/cli/text_table.h"
#include "tools/commands/commands.h"
#include "tools/sweep/step_ladder.h"
#include "tools/sweep/sweep_session.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

constexpr char kDefaultSweep[] = "push_ladder";
constexpr char kField[] = "sim.push[0].scaled_impulse";  // a share of m √(g h)

/// N·s that a direction's rungs survive; empty: not even the smallest push.
struct Rungs {
  double direction = 0;  ///< degrees, to the left of ahead
  double bound = 0;
  std::optional<double> planner, ideal, robot;
};

/// What a search found; `scale`: N·s of its unit.
std::optional<double> Found(const LimitSearch& search, double scale) {
  const std::optional<double> limit = search.limit();
  return limit ? std::optional(*limit * scale) : std::nullopt;
}

/// The planner's own rung, on the point mass.
std::optional<double> OfPlanner(const SweepDefinition& definition, int64_t point,
                                const StepLadder& ladder, const robot::RobotModel& model) {
  LimitSearch search(definition.sweep().limit());
  for (auto wanted = search.Wanted(); !wanted.empty(); wanted = search.Wanted()) {
    for (const double value : wanted) {
      const Scenario scenario =
          LoadScenario(definition.scenario(), definition.ChangesOf(point, value)).scenario;
      const PushProfile push(scenario.sim().push(0), model, ladder.impulse_scale(), "sim.push[0]");
      search.Add(value, ladder.Survives(push, 1 / scenario.tick_rate(), scenario.duration()));
    }
  }
  return Found(search, ladder.impulse_scale());
}

/// Fills one simulated rung of all. False: interrupted.
bool OfRobot(const SweepArguments& arguments, const std::string& name,
             const SessionOptions& options, double scale, std::vector<Rungs>* rungs,
             std::optional<double> Rungs::*rung) {
  const SweepDefinition definition(arguments, /*limit=*/true);
  SessionOptions own = options;
  if (!options.out.empty()) own.out = (std::filesystem::path(options.out) / name).string();
  SweepSession session(definition, kKindLimit, own);
  fmt::print("{}: {} directions, {} runs at a time; {}\n", name, rungs->size(), options.jobs,
             session.folder().string());
  if (!RunLimits(PointRange(0, static_cast<int64_t>(rungs->size())), &session)) return false;
  for (const LimitPoint& point : LimitPoints(session.header(), session.rows())) {
    (*rungs)[static_cast<size_t>(point.run)].*rung = Found(point.search, scale);
  }
  return true;
}

std::string Share(const std::optional<double>& of, const std::optional<double>& rung) {
  return of && rung && *of > 0 ? fmt::format("{:.2f}", *rung / *of) : "–";
}

/// The table, with the mean and the least of each rung where all directions have one.
std::string Format(const std::vector<Rungs>& rungs) {
  const auto number = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.1f}", *value) : "–";
  };
  std::vector<TableRow> table = {{"direction, °", "bound, N·s", "planner", "ideal robot", "robot",
                                  "planner/bound", "ideal/planner", "robot/ideal", "robot/bound"}};
  const auto add = [&](const std::string& name, const Rungs& r) {
    table.push_back({name, number(r.bound), number(r.planner), number(r.ideal), number(r.robot),
                     Share(r.bound, r.planner), Share(r.planner, r.ideal), Share(r.ideal, r.robot),
                     Share(r.bound, r.robot)});
  };
  for (const Rungs& r : rungs) add(fmt::format("{:g}", r.direction), r);
  Rungs mean, least = rungs.front();
  const auto gather = [&](std::optional<double> Rungs::*rung) {
    std::optional<double> sum = 0;
    for (const Rungs& r : rungs) {
      if (sum && r.*rung) {
        *sum += *(r.*rung);
        least.*rung = std::min(least.*rung, r.*rung);
      } else {
        sum.reset();
      }
    }
    if (sum) *sum /= static_cast<double>(rungs.size());
    mean.*rung = sum;
    if (!sum) least.*rung = {};
  };
  for (const Rungs& r : rungs) {
    mean.bound += r.bound / static_cast<double>(rungs.size());
    least.bound = std::min(least.bound, r.bound);
  }
  for (const auto rung : {&Rungs::planner, &Rungs::ideal, &Rungs::robot}) gather(rung);
  add("mean", mean);
  add("least", least);
  return FormatColumns(table);
}

int RunLadder(const SweepOptions& given) {
  SweepArguments arguments = given.arguments;
  const SessionOptions& options = given.session;
  if (!options.range.empty() || !options.part.empty()) {
    throw ConfigError(options.range.empty() ? "--part" : "--range",
                      "is not for a ladder, whose table has all directions");
  }
  if (arguments.what.empty()) arguments.what = kDefaultSweep;
  const SweepDefinition definition(arguments, /*limit=*/true);
  const auto points = static_cast<int64_t>(definition.points().size());
  const double least = definition.sweep().limit().min();
  const LoadedScenario loaded = LoadScenario(definition.scenario(), definition.ChangesOf(0, least));
  const Scenario& scenario = loaded.scenario;
  if (scenario.sim().push_size() != 1 || definition.sweep().limit().field() != kField) {
    throw ConfigError(
        definition.name(),
        "is no ladder's sweep: it needs one push, and limit.field "
        "sim.push[0].scaled_impulse; take deploy/sweeps/push_ladder.pbtxt as a model");
  }
  const robot::RobotModel model = robot::LoadRobotFiles(loaded.robot_file);
  const StepLadder ladder(model);
  std::vector<Rungs> rungs(static_cast<size_t>(points));
  for (int64_t point = 0; point < points; ++point) {
    Rungs& r = rungs[static_cast<size_t>(point)];
    const Scenario pushed =
        LoadScenario(definition.scenario(), definition.ChangesOf(point, least)).scenario;
    const Push& push = pushed.sim().push(0);
    const Eigen::Vector2d direction(push.direction_x(), push.direction_y());
    r.direction = std::fmod(std::atan2(direction.y(), direction.x()) * 180 / M_PI + 360, 360);
    r.direction = std::round(r.direction * 10) / 10;
    r.bound = ladder.Bound(direction.normalized());
    r.planner = OfPlanner(definition, point, ladder, model);
  }
  SweepArguments ideal = arguments;
  ideal.changes.ideal = true;
  const double scale = ladder.impulse_scale();
  if (!OfRobot(ideal, "ideal", options, scale, &rungs, &Rungs::ideal) ||
      !OfRobot(arguments, "robot", options, scale, &rungs, &Rungs::robot)) {
    fmt::print(stderr, "poise: interrupted; with --out FOLDER --resume it would go on\n");
    return kExitFailed;
  }
  fmt::print("\n{}, {:.1f} kg, m √(g h) {:.1f} N·s\n\n{}", model.name(), model.total_mass(), scale,
             Format(rungs));
  return kExitOk;
}

}  // namespace

void AddLadderCommand(CLI::App* app, Command* command) {
  const auto [ladder, options] = AddCommand<SweepOptions>(
      app, command, "ladder",
      "how much of a push each rung survives, from the pendulum's bound to the robot", RunLadder);
  AddSweepOptions(ladder, options);
  ladder->footer(
      "Rungs, N·s by direction of the push: the bound of as many steps as wanted from reach, "
      "soles and the least swing, m w (r + sum l_k e^(-w t_k)); what the planner catches on a "
      "point mass whose feet go where they are told; the ideal robot (--ideal); the robot. The "
      "share kept from each rung to the next says where a robot loses. sweep: default "
      "push_ladder, some 180 runs a rung; a limit of its own pushes once, by "
      "scaled_impulse. Exit code: as poise sweep.\n"
      "Example: poise ladder --set robot=heron/heron --world mujoco");
}

}  // namespace poise
