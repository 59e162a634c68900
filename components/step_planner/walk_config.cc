#include "components/step_planner/walk_config.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"
#include "components/step_planner/leg_limits.h"

namespace poise {
namespace {

// Friction of the ankles and errors of the model move the centre of pressure by this share of a
// sole's inner radius, with a reserve before the sole tips.
constexpr double kEdgeShare = 1.0 / 3;
/// The pendulum's offset is at most this share of the smaller sole's inner radius. Chosen.
constexpr double kOffsetShare = 0.67;
/// A foot rises by this share of the clearance from where it stands though the other stands lower:
/// the edges of tilted ground are higher than its middle. Chosen.
constexpr double kRiseShare = 0.5;
/// After this share of the swing a foot is above its foothold where the ground is unknown: it comes
/// down from above, not against a block's side. By then it has come down by a fifth of its height.
/// Chosen.
constexpr double kAcrossShare = 0.65;
/// In this share of the swing a foot only rises there: else its toe meets the side of the block
/// ahead on its way up, which fells the robot. Chosen.
constexpr double kWaitShare = 0.15;
/// 1/s. Faster it would follow the capture point's noise, and a tick of 10 ms would not follow it.
constexpr double kMostOffsetRate = 50;
/// rad in a step. Beyond it a foot points back.
constexpr double kMostTurn = 0.5 * M_PI;
/// Unloading puts the soles' own centres of pressure off their middles by this share of the smaller
/// sole's inner radius: on soft ground a sole rolls by as much. Chosen.
constexpr double kLeadShare = 0.13;
/// A press that sinks on beyond this share of the standing height is not a spring's. Chosen.
constexpr double kMostSinking = 0.3;
/// The COM goes down by this share of the standing height before the sole does. Chosen: with 0.3
/// the robot crouched to 70 % of its height where a press on one corner had let expect three times
/// as much.
constexpr double kMostAhead = 0.08;
/// m/s, that a sole sinks on average while it is loaded. At 10 kN/m the paper's robot loads as fast
/// as on hard ground. Chosen.
constexpr double kSinkSpeed = 0.04;
/// Ground counts as soft where a sole sinks under the weight by this share of the smaller sole's
/// inner radius: a stiffness of 18 kN/m under the paper's robot, which walks on 20 as on hard
/// ground.
constexpr double kSoftShare = 0.4;
constexpr double kRounding = 1e-6;
constexpr double kMostPress = 0.4;  // of the weight: more would lift the other foot off its middle

double LeastInnerRadius(const robot::RobotModel& model) {
  return std::min(robot::InnerRadius(model.feet()[0]), robot::InnerRadius(model.feet()[1]));
}

/// The paper's robot, whose walk the defaults are, has its COM at this height. Another's walk is
/// the same in units of g and of its COM's height, so that as much of the capture point's error
/// grows in a step.
constexpr double kDefaultHeight = 0.75;  // m

enum class Unit { kTime, kLength, kSpeed, kRate, kTurnAcceleration };
struct ScaledField {
  const char* name;
  Unit unit;
};
// Accelerations in m/s² are of g. Left as they are: `gap` and `touch_duration`, which are what a
// foot is off by and how long a hard sole bounces, and angles.
constexpr auto kScaledFields = std::to_array<ScaledField>({
    {"start", Unit::kTime},
    {"unload", Unit::kTime},
    {"swing", Unit::kTime},
    {"load", Unit::kTime},
    {"settle", Unit::kTime},
    {"freeze", Unit::kTime},
    {"rest_time", Unit::kTime},
    {"longest", Unit::kLength},
    {"widest", Unit::kLength},
    {"clearance", Unit::kLength},
    {"adjust_from", Unit::kLength},
    {"line", Unit::kLength},
    {"lower", Unit::kLength},
    {"reach_lower", Unit::kLength},
    {"rest_distance", Unit::kLength},
    {"touch_speed", Unit::kSpeed},
    {"rest_speed", Unit::kSpeed},
    {"offset_rate", Unit::kRate},
    {"height_rate", Unit::kRate},
    {"yaw_rate", Unit::kRate},
    {"turn_acceleration", Unit::kTurnAcceleration},
});

}  // namespace

WalkConfig WithRobotDefaults(WalkConfig config, double height) {
  const double length = height / kDefaultHeight, time = std::sqrt(length);
  const auto factor = [&](Unit unit) {
    switch (unit) {
      case Unit::kTime:
      case Unit::kSpeed:
        return time;
      case Unit::kLength:
        return length;
      case Unit::kRate:
        return 1 / time;
      case Unit::kTurnAcceleration:
        break;
    }
    return 1 / length;
  };
  const google::protobuf::Reflection& values = *config.GetReflection();
  for (const ScaledField& scaled : kScaledFields) {
    const auto* field = WalkConfig::descriptor()->FindFieldByName(scaled.name);
    if (values.HasField(config, field)) continue;
    values.SetDouble(&config, field, factor(scaled.unit) * values.GetDouble(config, field));
  }
  return config;
}

namespace {

/// WalkSpec's damping is `ratio` of what is critical for an ankle's rotor on the spring that a sole
/// of half sizes a and b has in the ground, weight a²/sinking and weight b²/sinking.
Eigen::Vector2d SoftDamping(const robot::RobotModel& model, double ratio) {
  const double weight = robot::kGravity * model.total_mass();
  Eigen::Vector2d least = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  for (const robot::FootModel& foot : model.feet()) {
    const auto leg = model.supporting_joints(foot.body);
    const double rotor =
        leg.empty() ? 0 : model.motors()[static_cast<size_t>(leg.back())].reflected_inertia;
    const Eigen::Vector2d half(0.5 * foot.width, 0.5 * foot.length);
    least = least.cwiseMin(2 * ratio * std::sqrt(rotor / weight) * half);
  }
  return least;
}

/// Throws ConfigError on what is `given` and this robot's legs cannot do. `config`: with the
/// robot's defaults, which are no one's mistake.
void CheckLegs(const WalkConfig& given, const WalkConfig& config, const robot::RobotModel& model,
               const stepping::Reach& reach, double spacing) {
  const double height = robot::StandingHeight(model);
  if (given.has_lower() && config.lower() > config.reach_lower() &&
      (config.lower() >= height ||
       stepping::Reach(model, height, config.lower(), config.joint_reserve(), config.gap())
           .empty())) {
    throw ConfigError("walk.lower",
                      fmt::format("is {} m; robot '{}', whose COM stands {:.3f} m high, cannot "
                                  "stand so much lower with joint_reserve {} rad: give less; it "
                                  "can {:.3f} m (reach_lower)",
                                  config.lower(), model.name(), height, config.joint_reserve(),
                                  config.reach_lower()));
  }
  if (given.has_gap()) CheckGap("walk", config.gap(), model, reach);
  if (given.has_clearance()) CheckClearance("walk", config.clearance(), model);
  const double longest = LongestStride(reach, spacing);
  if (given.has_longest() && config.longest() > longest) {
    throw ConfigError("walk.longest",
                      fmt::format("is {} m; the legs of robot '{}' span {:.3f} m ahead with the "
                                  "COM reach_lower {} m below standing: give 0 to that",
                                  config.longest(), model.name(), longest, config.reach_lower()));
  }
  const double widest = WidestStance(reach) - spacing;
  if (given.has_widest() && config.widest() > widest) {
    throw ConfigError("walk.widest",
                      fmt::format("is {} m; the legs of robot '{}' span {:.3f} m to the side "
                                  "beyond the soles side by side: give 0 to that",
                                  config.widest(), model.name(), std::max(0.0, widest)));
  }
}

void CheckWalk(bool holds, const char* name, const char* must) {
  if (!holds) throw ConfigError(std::string("walk.") + name, must);
}

}  // namespace

void CheckWalkConfig(const WalkConfig& config) {
  const auto not_negative = [](double value, const char* name) {
    CheckWalk(value >= 0 && std::isfinite(value), name, "must be a number, 0 or more");
  };
  const auto positive = [](double value, const char* name) {
    CheckWalk(value > 0 && std::isfinite(value), name, "must be a number above 0");
  };
  double last = -std::numeric_limits<double>::infinity();
  int last_steps = 0;
  for (int i = 0; i < config.command_size(); ++i) {
    const WalkCommandConfig& command = config.command(i);
    const std::string field = fmt::format("walk.command[{}]", i);
    const auto finite = [&](double value, const char* name, const char* what) {
      if (std::isfinite(value)) return;
      throw ConfigError(fmt::format("{}.{}", field, name),
                        fmt::format("is {}; must be a finite {}", value, what));
    };
    finite(command.time(), "time", "time in s");
    finite(command.vx(), "vx", "speed in m/s");
    finite(command.vy(), "vy", "speed in m/s");
    finite(command.wz(), "wz", "rate in rad/s");
    if (command.time() < 0) {
      throw ConfigError(field + ".time",
                        fmt::format("is {} s; must be 0 s or more, of the run", command.time()));
    }
    if (command.after_steps() < last_steps) {
      throw ConfigError(field + ".after_steps",
                        fmt::format("must be {} or more, {}", last_steps,
                                    i > 0 ? "as the command before" : "a number of steps"));
    }
    const bool by_steps = command.after_steps() > last_steps && !command.has_time();
    last_steps = command.after_steps();
    if (!by_steps && !(command.time() > last)) {
      throw ConfigError(field + ".time",
                        fmt::format("must come after command[{}].time = {}", i - 1, last));
    }
    last = std::max(last, command.time());
  }
  positive(config.start(), "start");
  positive(config.unload(), "unload");
  positive(config.swing(), "swing");
  positive(config.load(), "load");
  positive(config.settle(), "settle");
  not_negative(config.longest(), "longest");
  not_negative(config.widest(), "widest");
  CheckWalk(config.most_turn() >= 0 && config.most_turn() <= kMostTurn, "most_turn",
            "must be 0 to pi/2 rad");
  positive(config.acceleration(), "acceleration");
  positive(config.turn_acceleration(), "turn_acceleration");
  positive(config.clearance(), "clearance");
  positive(config.touch_speed(), "touch_speed");
  not_negative(config.touch_duration(), "touch_duration");
  positive(config.freeze(), "freeze");
  positive(config.gain(), "gain");
  not_negative(config.offset_rate(), "offset_rate");
  if (config.offset_rate() > kMostOffsetRate) {
    throw ConfigError("walk.offset_rate", fmt::format("must be at most {} 1/s", kMostOffsetRate));
  }
  not_negative(config.adjust_from(), "adjust_from");
  not_negative(config.edge(), "edge");
  not_negative(config.lower(), "lower");
  positive(config.reach_lower(), "reach_lower");
  not_negative(config.joint_reserve(), "joint_reserve");
  not_negative(config.gap(), "gap");
  positive(config.height_rate(), "height_rate");
  positive(config.yaw_rate(), "yaw_rate");
  positive(config.rest_distance(), "rest_distance");
  positive(config.rest_speed(), "rest_speed");
  not_negative(config.rest_time(), "rest_time");
  CheckWalk(config.press() >= 0 && config.press() <= kMostPress, "press", "must be 0 to 0.4");
  not_negative(config.line(), "line");
  CheckWalk(config.places() >= 0 && config.places() <= stepping::kMostPlaces, "places",
            "must be 0 to 4");
  not_negative(config.place_shift(), "place_shift");
  positive(config.patience(), "patience");
  not_negative(config.roll_damping(), "roll_damping");
  not_negative(config.give_up(), "give_up");
  not_negative(config.soft_damping(), "soft_damping");
  CheckWalk(config.slowest_swing() >= 1 && std::isfinite(config.slowest_swing()), "slowest_swing",
            "must be a number, 1 or more");
  CheckWalk(config.most_tilt() > 0 && config.most_tilt() < 0.5 * M_PI, "most_tilt",
            "must be above 0 and below pi/2 rad");
  std::array<double, 2> from{-std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()};
  for (int i = 0; i < config.ground_size(); ++i) {
    const KnownGroundConfig& ground = config.ground(i);
    const std::string field = fmt::format("walk.ground[{}]", i);
    if (!ground.has_foot()) throw ConfigError(field + ".foot", "is missing: whose lane is it?");
    if (!(std::isfinite(ground.from()) && std::isfinite(ground.height()))) {
      throw ConfigError(field, "must be of numbers");
    }
    double& last_from = from[static_cast<size_t>(ground.foot())];
    if (!(ground.from() > last_from)) {
      throw ConfigError(field + ".from", "must come after the last one's of this foot");
    }
    last_from = ground.from();
  }
}

stepping::Walk MakeWalk(const WalkConfig& given, const ContactConfirmation& contact,
                        const robot::RobotModel& model) {
  const double height = robot::StandingHeight(model);
  const WalkConfig config = WithRobotDefaults(given, height);
  double edge = config.edge();
  if (!config.has_edge()) {
    edge = kEdgeShare * LeastInnerRadius(model);
  }
  for (const robot::FootModel& foot : model.feet()) {
    if (edge < robot::InnerRadius(foot)) continue;
    throw ConfigError("walk.edge",
                      fmt::format("is {} m and leaves nothing of the {} foot's sole, {} x {} m",
                                  edge, foot.name, foot.length, foot.width));
  }
  const stepping::Reach reach(model, height, config.reach_lower(), config.joint_reserve(),
                              config.gap());
  if (reach.empty()) {
    // A field that nobody gave is not to blame.
    throw ConfigError(
        given.has_reach_lower() ? "walk.reach_lower" : "walk",
        fmt::format("robot '{}', whose COM stands {:.3f} m high, cannot stand {:.3f} m lower "
                    "(reach_lower) with {} rad between its joints and their limits "
                    "(joint_reserve): give less of either",
                    model.name(), height, config.reach_lower(), config.joint_reserve()));
  }
  stepping::StepLimits limits;
  limits.edge = edge;
  limits.spacing = std::max(robot::StandingSpacing(model), reach.least_spacing());
  CheckLegs(given, config, model, reach, limits.spacing);

  stepping::WalkSpec spec;
  spec.start = config.start();
  spec.unload = config.unload();
  spec.swing = config.swing();
  spec.settle = config.settle();
  spec.load = config.load();
  spec.step = {limits.spacing, reach.least_spacing(), config.longest(), config.widest(),
               config.most_turn()};
  spec.acceleration = config.acceleration();
  spec.turn_acceleration = config.turn_acceleration();
  spec.foot = {config.clearance(),
               config.touch_speed(),
               config.freeze(),
               kRiseShare * config.clearance(),
               config.rests() ? kAcrossShare : 1,
               config.rests() ? kWaitShare : 0};
  spec.touch_load = contact.touch_load();
  spec.release_load = contact.release_load();
  spec.touch_duration = config.touch_duration();
  spec.search_depth = contact.search_depth();
  spec.gain = config.gain();
  spec.offset_rate = config.offset_rate();
  spec.most_offset = kOffsetShare * LeastInnerRadius(model);
  spec.adjust_from = config.adjust_from();
  spec.lower = config.lower();
  spec.height_rate = config.height_rate();
  spec.yaw_rate = config.yaw_rate();
  spec.rest_distance = config.rest_distance();
  spec.rest_speed = config.rest_speed();
  spec.rest_time = config.rest_time();
  spec.rests = config.rests();
  spec.press_share = config.press();
  spec.press_load =
      std::max(config.press() * robot::kGravity * model.total_mass(), spec.touch_load);
  spec.off_center = 0.5 * (LeastInnerRadius(model) - edge);
  spec.line = config.line();
  spec.places = config.places();
  spec.stand_apart = config.stand_apart();
  spec.place_shift = config.place_shift();
  spec.patience = config.patience();
  spec.roll_damping = config.roll_damping() / (robot::kGravity * model.total_mass());
  spec.lead = kLeadShare * LeastInnerRadius(model);
  spec.weight = robot::kGravity * model.total_mass();
  spec.most_sinking = kMostSinking * height;
  spec.most_ahead = kMostAhead * height;
  spec.sink_speed = kSinkSpeed;
  spec.give_up = config.give_up();
  spec.soft = kSoftShare * LeastInnerRadius(model);
  spec.slowest_swing = config.slowest_swing();
  spec.soft_damping = SoftDamping(model, config.soft_damping());
  spec.most_tilt = config.most_tilt();
  for (const KnownGroundConfig& edge : config.ground()) {
    spec.ground.Add(edge.foot(), edge.from(), edge.height());
  }
  return {stepping::StepChoice(model, reach, limits), spec};
}

std::vector<std::string> WalkWarnings(const WalkConfig& given, const robot::RobotModel& model) {
  std::vector<std::string> warnings;
  if (!given.enabled()) {
    if (given.command_size() > 0) {
      warnings.emplace_back("walk.command has no effect without walk.enabled=true");
    }
    return warnings;
  }
  const WalkConfig config = WithRobotDefaults(given, robot::StandingHeight(model));
  const double period = config.unload() + config.swing() + config.settle() + config.load();
  const double fastest = config.longest() / period;
  for (int i = 0; i < config.command_size(); ++i) {
    const WalkCommandConfig& command = config.command(i);
    if (command.stop()) continue;
    // Aside and in a turn only every second step goes out (stepping::NextFootstep).
    const struct {
      const char* name;
      double value, most;  // m/s or rad/s
      const char* unit;
      const char* limit;
      double in_a_step;  // m or rad
      const char* steps;
      double time;  // s
    } parts[] = {{"vx", command.vx(), fastest, "m", "longest", config.longest(), "a step", period},
                 {"vy", command.vy(), config.widest() / (2 * period), "m", "widest",
                  config.widest(), "two steps", 2 * period},
                 {"wz", command.wz(), config.most_turn() / (2 * period), "rad", "most_turn",
                  config.most_turn(), "two steps", 2 * period}};
    for (const auto& part : parts) {
      if (!(std::abs(part.value) > part.most * (1 + kRounding))) continue;
      warnings.push_back(fmt::format(
          "walk.command[{}].{}={} is walked at {:.3g} {}/s: `{}` "
          "allows {:.3g} {} in {}, which {} {:.3g} s",
          i, part.name, part.value, std::copysign(part.most, part.value), part.unit, part.limit,
          part.in_a_step, part.unit, part.steps, &part == &parts[0] ? "takes" : "take", part.time));
    }
  }
  if (config.rests()) return warnings;
  const auto idle = [&](bool given_one, const char* name) {
    if (!given_one) return;
    warnings.push_back(fmt::format("walk.{} has no effect without walk.rests=true", name));
  };
  idle(config.places() > 0, "places");
  idle(config.give_up() > 0, "give_up");
  idle(config.soft_damping() > 0, "soft_damping");
  idle(config.slowest_swing() > 1, "slowest_swing");
  return warnings;
}

WalkCommands::WalkCommands(const WalkConfig& config) {
  for (const WalkCommandConfig& command : config.command()) {
    stepping::WalkCommand walk;
    if (!command.stop()) walk = {{command.vx(), command.vy()}, command.wz(), true};
    entry_.push_back({command.time(), command.after_steps(), walk});
  }
}

stepping::WalkCommand WalkCommands::At(double time, int num_steps) const {
  stepping::WalkCommand command;
  for (const Entry& entry : entry_) {
    if (entry.time > time || entry.after_steps > num_steps) break;
    command = entry.command;
  }
  return command;
}

}  // namespace poise
