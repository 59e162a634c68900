#include "components/step_planner/walk_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"
#include "components/step_planner/legs/leg_limits.h"
#include "components/step_planner/planner_config.h"
#include "components/step_planner/stepping/recovery.h"

namespace poise {
namespace {

// Shares of the smaller sole's inner radius. The centre of pressure keeps a third off a sole's
// edge: friction of the ankles and errors of the model move it by as much, and the sole tips
// beyond.
constexpr double kSoleMarginShare = 1.0 / 3;
// The pendulum's offset is taken for two thirds at most, so that it stays on the sole.
constexpr double kOffsetShare = 0.67;
// Unloading puts the soles' own centres of pressure 0.13 off their middles: a sole on soft ground
// rolls by as much.
constexpr double kLoadLeadShare = 0.13;
// Ground counts as soft where a sole sinks by 0.4 under the weight: the paper's robot walks on 20
// kN/m as on hard ground, and this is 18 kN/m.
constexpr double kSoftShare = 0.4;

// Shares of the clearance and of the swing. A foot rises by half of the clearance though the other
// one stands lower: the edges of tilted ground are higher than its middle.
constexpr double kRiseShare = 0.5;
// On unknown ground a foot is above its foothold after 0.65 of the swing: it comes down from above,
// not against a block's side, and has come down by a fifth of its height by then.
constexpr double kAcrossShare = 0.65;
// It only rises for 0.15 of the swing: its toe met the side of the block ahead, which felled.
constexpr double kWaitShare = 0.15;

// Shares of the standing height. A press that sinks by more than 0.3 is not a spring's.
constexpr double kMostSinking = 0.3;
// The COM goes down by 0.08 before the sole does: with 0.3 the robot crouched to 70 % of its height
// where a press on one corner had let expect three times as much.
constexpr double kMostAhead = 0.08;

// The numbers of the gait of the paper's robot, whose COM stands 0.75 m high. Another robot's is
// the same in units of g and of its own height, so that as much of the capture point's error grows
// in a step (RobotScale).
constexpr double kDefaultHeight = 0.75;  // m
constexpr double kStart = 0.8;           // s in which the COM leaves the middle for the stance foot
constexpr double kUnload = 0.8;          // s of the ramp (61) before a foot leaves the ground
constexpr double kSwing = 1.1;           // s in the air
// s from a touch until the foot is a contact of the model: its reference comes to where the sole
// stands meanwhile, so that the change makes no step of the torque.
constexpr double kSettle = 0.2;
constexpr double kLoad = 0.8;          // s of the ramp after the foot has landed
constexpr double kComLowering = 0.08;  // m below standing, so that knees can give
constexpr double kHeightRate = 4;      // 1/s with which the COM's height goes where legs ask for it
constexpr double kFreeze = 0.1;        // s before touch-down: a foothold that moves then jerks
constexpr double kStillTime = 0.3;     // s of rest until it stands: a swing of the COM is longer
constexpr double kWidest = 0.12;       // m to the side in a step, beyond the feet side by side
constexpr double kMostTurn = 0.35;     // rad in a step, not scaled: a hip turns by as much
constexpr double kMostReturn = 0.03;   // m a step back to the course: more would be a lurch
constexpr double kReachLowering = 0.06;  // m below standing: footholds in reach leave knees bent
constexpr double kStillDistance = 0.02;  // m from the soles' middle: as the estimate is known to
constexpr double kTouchSpeed = 0.1;   // m/s downward: a foot that meets the ground harder bounces
constexpr double kStillSpeed = 0.04;  // m/s of the COM, as kStillDistance in an ω
constexpr double kYawRate = 5;        // 1/s with which the body's heading follows the feet's
constexpr double kTurnAcceleration = 0.2;  // rad/s² with which the turn rate is approached
// Not scaled: a hard sole bounces as long on any robot.
constexpr double kTouchDuration = 0.002;  // s of contact.touch_load that are a landing
// s, time constant with which a foot that has touched is let go in the ground's plane.
constexpr double kRelaxTime = 0.015;

constexpr double kRounding = 1e-6;

double LeastInnerRadius(const robot::RobotModel& model) {
  return std::min(robot::InnerRadius(model.feet()[0]), robot::InnerRadius(model.feet()[1]));
}

/// Turns what is the paper's robot's into what is the same of another one in units of g and height.
class RobotScale {
 public:
  explicit RobotScale(const robot::RobotModel& model)
      : length_(robot::StandingHeight(model) / kDefaultHeight), time_(std::sqrt(length_)) {}
  double Time(double time) const { return time_ * time; }
  double Length(double length) const { return length_ * length; }
  double Speed(double speed) const { return time_ * speed; }
  double Rate(double rate) const { return 1 / time_ * rate; }
  double TurnAcceleration(double acceleration) const { return 1 / length_ * acceleration; }

 private:
  double length_, time_;
};

/// m of the capture point from the middle of the sole that carries, at which the other foot leaves
/// the ground.
double LiftOffDistance(const robot::RobotModel& model, const stepping::StepLimits& limits) {
  return 0.5 * (LeastInnerRadius(model) - limits.sole_margin);
}

/// Throws ConfigError on what is given and this robot's legs cannot do.
void CheckLegs(const WalkConfig& given, const robot::RobotModel& model,
               const stepping::Reach& reach, double spacing) {
  if (given.has_gap()) CheckGap(given.gap(), model, reach);
  if (given.has_clearance()) CheckClearance(given.clearance(), model);
  const double longest = LongestStride(reach, spacing);
  if (given.has_longest() && given.longest() > longest) {
    throw ConfigError("walk.longest",
                      fmt::format("is {} m; the legs of robot '{}' span {:.3f} m ahead with the "
                                  "COM {:.3f} m below standing: give 0 to that",
                                  given.longest(), model.name(), longest, reach.lowering()));
  }
}

/// What a step of a walk comes to at most.
struct StrideSize {
  double longest, widest, most_turn;  ///< m, m, rad
  double period;                      ///< s
  std::array<const char*, 3> limit;   ///< what says so, of each
};

StrideSize QuasiStaticStride(const WalkConfig& config, const robot::RobotModel& model,
                             const stepping::StepChoice& choice) {
  const stepping::QuasiStaticSpec spec =
      MakeQuasiStaticSpec(config, ContactConfirmation(), model, choice);
  return {spec.step.longest,
          spec.step.widest,
          spec.step.most_turn,
          spec.period(),
          {"`longest` allows", "the legs span", "a foot turns"}};
}

StrideSize DynamicStride(const robot::RobotModel& model, const stepping::StepLimits& limits) {
  const double frequency = std::sqrt(robot::kGravity / robot::StandingHeight(model));
  return {limits.longest,
          limits.widest,
          limits.most_turn,
          stepping::Recovery::kOmegaStepTime / frequency,
          {"the legs span", "the legs span", "a foot turns"}};
}

void CheckCommands(const WalkConfig& config) {
  double last = -std::numeric_limits<double>::infinity();
  int last_steps = 0;
  for (int i = 0; i < config.command_size(); ++i) {
    const WalkCommandConfig& command = config.command(i);
    const std::string field = fmt::format("walk.command[{}]", i);
    if (command.after_steps() < last_steps) {
      throw ConfigError(field + ".after_steps",
                        fmt::format("must be {} or more, as the command before", last_steps));
    }
    const bool by_steps = command.after_steps() > last_steps && !command.has_time();
    last_steps = command.after_steps();
    if (!by_steps && !(command.time() > last)) {
      throw ConfigError(field + ".time",
                        fmt::format("must come after command[{}].time = {}", i - 1, last));
    }
    last = std::max(last, command.time());
  }
}

void CheckGround(const WalkConfig& config) {
  robot::FootArray<double> from(-std::numeric_limits<double>::infinity());
  for (int i = 0; i < config.ground_size(); ++i) {
    const KnownGroundConfig& ground = config.ground(i);
    const std::string field = fmt::format("walk.ground[{}]", i);
    if (!ground.has_foot()) throw ConfigError(field + ".foot", "is missing: whose lane is it?");
    double& last_from = from[robot::FootAt(ground.foot())];
    if (!(ground.from() > last_from)) {
      throw ConfigError(field + ".from", "must come after the last one's of this foot");
    }
    last_from = ground.from();
  }
}

}  // namespace

void CheckWalkConfig(const WalkConfig& config) {
  CheckCommands(config);
  CheckGround(config);
  // Only a dynamic walk takes its footholds from the port.
  if (config.stride_port() && (!config.enabled() || config.quasi_static())) {
    throw ConfigError("walk.stride_port",
                      "is true: needs walk.enabled=true and walk.quasi_static=false");
  }
}

stepping::StepChoice MakeWalkChoice(const WalkConfig& config, const robot::RobotModel& model) {
  const double height = robot::StandingHeight(model);
  const double lowering = RobotScale(model).Length(kReachLowering);
  const stepping::Reach reach(model, height, lowering, config.gap());
  if (reach.empty()) {
    throw ConfigError(
        "walk", fmt::format("robot '{}', whose COM stands {:.3f} m high, cannot stand {:.3f} m "
                            "lower with {} rad between its joints and their limits: its file's "
                            "stance or limits leave no room to walk",
                            model.name(), height, lowering, stepping::Reach::kJointReserve));
  }
  stepping::StepLimits limits;
  limits.sole_margin = kSoleMarginShare * LeastInnerRadius(model);
  limits.spacing = std::max(robot::StandingSpacing(model), reach.least_spacing());
  CheckLegs(config, model, reach, limits.spacing);
  CheckStanceLegs(LiftOffDistance(model, limits), model, reach, height);
  return {model, reach, limits};
}

stepping::QuasiStaticSpec MakeQuasiStaticSpec(const WalkConfig& config,
                                              const ContactConfirmation& contact,
                                              const robot::RobotModel& model,
                                              const stepping::StepChoice& choice) {
  const RobotScale scale(model);
  const double height = robot::StandingHeight(model), radius = LeastInnerRadius(model);
  const double weight = robot::kGravity * model.total_mass();
  stepping::QuasiStaticSpec spec;
  spec.start = scale.Time(kStart);
  spec.unload = scale.Time(kUnload);
  spec.swing = scale.Time(kSwing);
  spec.load = scale.Time(kLoad);
  spec.step = {choice.limits().spacing, choice.reach().least_spacing(),
               config.has_longest() ? config.longest() : scale.Length(config.longest()),
               scale.Length(kWidest), kMostTurn};
  spec.turn_acceleration = scale.TurnAcceleration(kTurnAcceleration);
  const double clearance =
      config.has_clearance() ? config.clearance() : scale.Length(config.clearance());
  spec.foot = {clearance,           scale.Speed(kTouchSpeed),
               scale.Time(kFreeze), kRiseShare * clearance,
               kAcrossShare,        kWaitShare};
  spec.landing = MakeLandingSpec(contact);
  spec.landing.touch_duration = kTouchDuration;
  spec.landing.settle = scale.Time(kSettle);
  spec.landing.search_speed = scale.Speed(kTouchSpeed);
  spec.landing.relax_time = kRelaxTime;
  spec.landing.press_load =
      std::max(stepping::QuasiStaticWalk::kPressShare * weight, spec.landing.press_load);
  spec.landing.presses = true;
  spec.landing.retracts = false;
  spec.most_offset = kOffsetShare * radius;
  spec.com_lowering = scale.Length(kComLowering);
  spec.height_rate = scale.Rate(kHeightRate);
  spec.yaw_rate = scale.Rate(kYawRate);
  spec.still_distance = scale.Length(kStillDistance);
  spec.still_speed = scale.Speed(kStillSpeed);
  spec.still_time = scale.Time(kStillTime);
  spec.lift_off_distance = LiftOffDistance(model, choice.limits());
  spec.most_return = scale.Length(kMostReturn);
  spec.load_lead = kLoadLeadShare * radius;
  spec.weight = weight;
  spec.most_sinking = kMostSinking * height;
  spec.most_ahead = kMostAhead * height;
  spec.soft = kSoftShare * radius;
  for (const KnownGroundConfig& edge : config.ground()) {
    spec.ground.Add(robot::FootAt(edge.foot()), edge.from(), edge.height());
  }
  return spec;
}

stepping::QuasiStaticWalk MakeQuasiStaticWalk(const WalkConfig& config,
                                              const ContactConfirmation& contact,
                                              const robot::RobotModel& model) {
  const stepping::StepChoice choice = MakeWalkChoice(config, model);
  return {choice, MakeQuasiStaticSpec(config, contact, model, choice)};
}

std::vector<std::string> WalkWarnings(const WalkConfig& config, const robot::RobotModel& model,
                                      const stepping::StepChoice& choice) {
  std::vector<std::string> warnings;
  if (!config.enabled()) {
    if (config.command_size() > 0) {
      warnings.emplace_back("walk.command has no effect without walk.enabled=true");
    }
    return warnings;
  }
  if (config.stride_port() && config.command_size() > 0) {
    warnings.emplace_back("walk.command has no effect with walk.stride_port=true");
  }
  const StrideSize size = config.quasi_static() ? QuasiStaticStride(config, model, choice)
                                                : DynamicStride(model, choice.limits());
  for (int i = 0; i < config.command_size(); ++i) {
    const WalkCommandConfig& command = config.command(i);
    if (command.stop()) continue;
    // Aside and in a turn only every second step goes out (stepping::NextFootstep).
    const struct {
      const char* name;
      double value, in_a_step;  // m/s or rad/s; m or rad
      const char *unit, *limit, *steps;
      int count;  // of steps
    } parts[] = {{"vx", command.vx(), size.longest, "m", size.limit[0], "a step", 1},
                 {"vy", command.vy(), size.widest, "m", size.limit[1], "two steps", 2},
                 {"wz", command.wz(), size.most_turn, "rad", size.limit[2], "two steps", 2}};
    for (const auto& part : parts) {
      const double time = part.count * size.period, most = part.in_a_step / time;
      if (!(std::abs(part.value) > most * (1 + kRounding))) continue;
      warnings.push_back(fmt::format(
          "walk.command[{}].{}={} is walked at {:.3g} {}/s: {} {:.3g} {} in {}, which {} {:.3g} s",
          i, part.name, part.value, std::copysign(most, part.value), part.unit, part.limit,
          part.in_a_step, part.unit, part.steps, part.count == 1 ? "takes" : "take", time));
    }
  }
  if (config.quasi_static()) return warnings;
  for (const auto& [name, given] : {std::pair{"longest", config.has_longest()},
                                    {"clearance", config.has_clearance()},
                                    {"gap", config.has_gap()},
                                    {"ground", config.ground_size() > 0}}) {
    if (!given) continue;
    warnings.push_back(fmt::format("walk.{} has no effect without walk.quasi_static=true", name));
  }
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
