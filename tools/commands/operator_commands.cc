#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/terminal.h"
#include "tools/cli/text_table.h"
#include "tools/commands/commands.h"
#include "tools/operator/bus_port.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_registry.h"

namespace poise {
namespace {

using ActKind = OperatorAct::Kind;

constexpr char kWhichRun[] = "folder or name of the run; default: the only one that goes on";
constexpr double kMostWeights = 10;  // a push beyond is a slip of the hand: no robot withstands one

double NumberOf(std::string_view text, const std::string& flag) {
  if (const auto number = NumberIn<double>(text)) return *number;
  throw ConfigError(fmt::format("{}: '{}' is no number", flag, text));
}

/// "x,y,z".
std::vector<double> NumbersOf(std::string_view text, size_t count, const std::string& flag) {
  std::vector<double> numbers;
  for (const std::string& part : Split(text, ',')) numbers.push_back(NumberOf(part, flag));
  if (numbers.size() != count) {
    throw ConfigError(fmt::format("{}: needs {} numbers with commas between them, has {}", flag,
                                  count, numbers.size()));
  }
  return numbers;
}

Eigen::Vector3d VectorOf(const std::string& text, const std::string& flag) {
  const std::vector<double> numbers = NumbersOf(text, 3, flag);
  return {numbers[0], numbers[1], numbers[2]};
}

OperatorAct ActOf(ActKind kind, const std::string& name = {}) {
  OperatorAct act;
  act.kind = kind;
  act.name = name;
  return act;
}

struct ActedRun {
  std::filesystem::path dir;
  std::unique_ptr<BusPort> port;
};

/// `command`: "poise push". Says which run it is where `run` did not, before anything is done to
/// it.
ActedRun FindActedRun(const std::string& run, const std::string& command) {
  const std::string naming = command + " --run";
  std::filesystem::path dir;
  if (run.empty()) {
    const RunningRun only = OnlyRunningRun("", naming);
    fmt::print(stderr, "the run: {}\n", FormatRun(only));
    dir = only.dir;
  } else {
    dir = RunNamed(run, naming);
  }
  try {
    auto port = std::make_unique<BusPort>(ReadRunSpec(dir.string()));
    port->fields();  // throws where the run takes no acts
    port->Join();
    return {dir, std::move(port)};
  } catch (const BusError&) {
    if (RunInProgress(dir)) throw;
    throw std::runtime_error(fmt::format("{}: this run has ended", dir.string()));
  }
}

/// Says what became of `what`; the exit code.
int SayOutcome(const ActedRun& run, const OperatorAct& act, const std::string& what) {
  const RunSpec& spec = run.port->spec();
  if (act.state == OperatorAct::State::kAccepted) {
    fmt::print("{}: from tick {} on ({:.3f} s)\n", what, act.tick,
               MakeTick(act.tick, spec.tick_period(), spec.lead_ticks()).time);
    return kExitOk;
  }
  const bool ended = act.tick < 0 && !RunInProgress(run.dir);
  fmt::print(stderr, "poise: {}: {}\n", what, ended ? "this run has ended" : act.reason);
  return kExitFailed;
}

int DoAct(const ActedRun& run, const OperatorAct& act, const std::string& what) {
  return SayOutcome(run, run.port->Wait({act}).front(), what);
}

/// "NAME=NUMBER", each as an act of `kind`; `command` and `form` are what a message names.
std::vector<OperatorAct> ActsOf(ActKind kind, const std::vector<std::string>& assignments,
                                const std::string& command, const std::string& form) {
  std::vector<OperatorAct> acts;
  for (const std::string& assignment : assignments) {
    const size_t equals = assignment.find('=');
    if (equals == std::string::npos) {
      throw ConfigError(fmt::format("{}: '{}' is no {}", command, assignment, form));
    }
    acts.push_back(ActOf(kind, assignment.substr(0, equals)));
    acts.back().value = NumberOf(std::string_view(assignment).substr(equals + 1), acts.back().name);
  }
  return acts;
}

/// Sends them together, says what became of each; the exit code.
int DoAssignments(const ActedRun& run, std::vector<OperatorAct> acts) {
  int exit_code = kExitOk;
  for (const OperatorAct& act : run.port->Wait(std::move(acts))) {
    const int code = SayOutcome(run, act, fmt::format("{}={}", act.name, act.value));
    if (code != kExitOk) exit_code = code;
  }
  return exit_code;
}

struct LiveSetOptions {
  std::string run;
  std::vector<std::string> assignments;
  bool list = false;
};

int ListLiveFields(const ActedRun& run) {
  std::vector<TableRow> rows{{"field", "now", "unit", "from", "to", "meaning"}};
  int exit_code = kExitOk;
  for (const LiveField& field : run.port->fields()) {
    const OperatorAct now = run.port->Wait({ActOf(ActKind::kAsk, field.path)}).front();
    if (now.state != OperatorAct::State::kAccepted) {
      fmt::print(stderr, "poise: {}: {}\n", field.path, now.reason);
      exit_code = kExitFailed;
      break;  // the others would be waited for as long
    }
    rows.push_back({field.path, FormatNumber(now.value), field.unit, FormatNumber(field.least),
                    FormatNumber(field.most), field.meaning});
  }
  if (rows.size() > 1) fmt::print("{}", FormatColumns(rows));
  return exit_code;
}

int SetLiveFields(const LiveSetOptions& options) {
  if (options.list == !options.assignments.empty()) {
    throw ConfigError("set: needs FIELD=VALUE, or --list");
  }
  std::vector<OperatorAct> acts = ActsOf(
      ActKind::kSet, options.assignments, "set",
      "FIELD=VALUE, as in task_controller.com.kp=200; poise set --list shows fields and ranges");
  const ActedRun run = FindActedRun(options.run, "poise set");
  return options.list ? ListLiveFields(run) : DoAssignments(run, std::move(acts));
}

struct MoveOptions {
  std::string run;
  std::vector<std::string> assignments;
  double duration = 1;  // s
};

int MoveJoints(const MoveOptions& options) {
  std::vector<OperatorAct> acts = ActsOf(ActKind::kMove, options.assignments, "move",
                                         "JOINT=ANGLE, as in left_elbow_pitch=-0.8");
  for (OperatorAct& act : acts) act.duration = options.duration;
  return DoAssignments(FindActedRun(options.run, "poise move"), std::move(acts));
}

struct RobotPushOptions {
  std::string run, body, force, point = "0,0,0";
  double duration = 0.1;  // s
};

int PushRobot(const RobotPushOptions& options) {
  OperatorAct push = ActOf(ActKind::kPush, options.body);
  push.force = VectorOf(options.force, "--force");
  push.point = VectorOf(options.point, "--point");
  push.duration = options.duration;
  const ActedRun run = FindActedRun(options.run, "poise push");
  const double most = kMostWeights * run.port->weight();
  if (push.force.norm() > most) {
    throw ConfigError(
        fmt::format("push: {:.6g} N is more than {:.0f} N, {:.0f} times the robot's "
                    "weight",
                    push.force.norm(), most, kMostWeights));
  }
  return DoAct(run, push,
               fmt::format("push of {:.4g} N for {:.4g} s", push.force.norm(), push.duration));
}

struct RobotStepOptions {
  std::string run, foot;
  bool next_phase = false, together = false;
};

int StepInPlace(const RobotStepOptions& options) {
  const ActedRun run = FindActedRun(options.run, "poise step");
  if (options.together) {
    const int code = DoAct(run, ActOf(ActKind::kStopWalking), "feet together");
    // The planner's answer does not tell whether there is anything to do.
    if (code == kExitOk) fmt::print("feet that stand side by side already stay\n");
    return code;
  }
  return options.next_phase ? DoAct(run, ActOf(ActKind::kNextPhase), "next phase")
                            : DoAct(run, ActOf(ActKind::kStep, options.foot), "step");
}

struct RobotWalkOptions {
  std::string run, velocity;
  std::optional<double> turn;  // rad/s
  bool stop = false;
};

int WalkRobot(const RobotWalkOptions& options) {
  if (options.stop == (!options.velocity.empty() || options.turn)) {
    throw ConfigError("walk: needs --velocity, --turn or both; or --stop alone");
  }
  std::vector<double> velocity{0, 0};
  if (!options.velocity.empty()) velocity = NumbersOf(options.velocity, 2, "--velocity");
  const ActedRun run = FindActedRun(options.run, "poise walk");
  if (options.stop) return DoAct(run, ActOf(ActKind::kStopWalking), "stop walking");
  OperatorAct walk = ActOf(ActKind::kWalk);
  walk.velocity = {velocity[0], velocity[1], options.turn.value_or(0)};
  return DoAct(run, walk, "walk");
}

}  // namespace

void AddOperatorCommands(CLI::App* app, Command* command) {
  const auto [set, set_options] = AddCommand<LiveSetOptions>(
      app, command, "set", "change a setting of a run that goes on", SetLiveFields);
  set->add_option("assignment", set_options->assignments,
                  "FIELD=VALUE, as in task_controller.com.kp=200");
  set->add_flag("--list", set_options->list,
                "the fields that can be set, with range, present value and meaning");
  set->add_option("--run", set_options->run, kWhichRun);
  SetExample(set, "poise set task_controller.com.kp=200");

  const auto [push, push_options] = AddCommand<RobotPushOptions>(
      app, command, "push", "push the simulated robot of a run that goes on", PushRobot);
  push->add_option("--body", push_options->body, "link that a joint carries; default: the root");
  push->add_option("--force", push_options->force,
                   "N, world axes: x,y,z; at most ten times the robot's weight")
      ->required();
  push->add_option("--duration", push_options->duration,
                   "s; below 0: until the next push of this body")
      ->capture_default_str();
  push->add_option("--point", push_options->point, "m, in the body's frame: x,y,z")
      ->capture_default_str();
  push->add_option("--run", push_options->run, kWhichRun);
  push->footer("Example: poise push --force 0,60,0 --duration 0.1");

  const auto [step, step_options] = AddCommand<RobotStepOptions>(
      app, command, "step",
      "a step in place of a run that goes on: each foot once, then side by side", StepInPlace);
  step->add_option("--foot", step_options->foot,
                   "the one that steps first, e.g. left; default: right");
  CLI::Option* both =
      step->add_flag("--together", step_options->together,
                     "the feet side by side instead, after steps that caught a push");
  step->add_flag("--next-phase", step_options->next_phase,
                 "end the scenario's phase, whose moves are over, instead")
      ->excludes("--together");
  step->add_option("--run", step_options->run, kWhichRun);
  both->excludes("--foot");
  SetExample(step, "poise step --foot left");

  const auto [move, move_options] = AddCommand<MoveOptions>(
      app, command, "move",
      "move arms, hands, head or waist in a run that goes on: joints that no leg needs",
      MoveJoints);
  move->add_option("assignment", move_options->assignments, "JOINT=ANGLE, in rad")->required();
  move->add_option("--duration", move_options->duration,
                   "s until they rest there; longer where a joint's limits ask for it")
      ->capture_default_str();
  move->add_option("--run", move_options->run, kWhichRun);
  move->footer("Example: poise move left_elbow=0.5 right_elbow=0.5 --duration 0.5");

  const auto [walk, walk_options] = AddCommand<RobotWalkOptions>(
      app, command, "walk", "walk, in a run that goes on, or stop walking", WalkRobot);
  walk->add_option(
      "--velocity", walk_options->velocity,
      "m/s ahead and to the left, x,y, each within 1; steps and settings of the run allow less");
  walk->add_option("--turn", walk_options->turn, "rad/s to the left, within 1");
  walk->add_flag("--stop", walk_options->stop,
                 "stand, with the feet side by side, or as they are with walk.quasi_static");
  walk->add_option("--run", walk_options->run, kWhichRun);
  walk->footer("Example: poise walk --velocity 0.1,0 --turn 0.1");
}

}  // namespace poise
