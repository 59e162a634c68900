#include "tools/robot/robot_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "components/balance/support_polygon.h"
#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "sim/start_posture.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"
#include "tools/robot/walking_loads.h"

namespace poise {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Json = nlohmann::ordered_json;
using robot::RobotModel;
using robot::RobotState;
using std::numbers::pi;

constexpr int kDirections = 16;
constexpr double kReachStep = 0.005;   // m, that reach is found to
constexpr double kLongestReach = 1.5;  // m, that is tried
constexpr double kAtLimit = 0.01;      // rad
// kg/m³, a robot's mass over the cube of its COM's height: a person has 75.
constexpr double kMostDensity = 3000;
double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

std::optional<RobotState> TrySolve(const RobotModel& model, const robot::PostureGoal& goal) {
  try {
    return robot::SolvePosture(model, goal);
  } catch (const robot::RobotError&) {
    return {};  // out of reach
  }
}

/// The stance as a goal, from which others are asked for.
robot::PostureGoal StanceGoal(const RobotCheck& check) {
  const robot::RobotData data = Evaluate(check.model, check.stance);
  robot::PostureGoal goal;
  goal.foot = {data.foot_pose[0], data.foot_pose[1]};
  goal.com_xy = data.com.head<2>();
  goal.com_height = data.com.z();
  goal.nominal = check.stance.joint_position;
  return goal;
}

void FindLoads(RobotCheck* check) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const RobotModel& model = check->model;
  const Eigen::VectorXd both = HoldingTorque(model, check->stance, {true, true});
  const std::optional<Eigen::VectorXd> single = OneFootTorque(model, check->stance);
  check->stands_on_one_foot = single.has_value();
  std::optional<StepLoads> step;
  if (single) {
    try {
      step = LoadsOfAStep(model, check->stance, both);
      if (!step) {
        check->defects.push_back(fmt::format(
            "a step of the walk at {} m/s is out of the legs' reach: a lower stance, or feet "
            "nearer to each other, may bring it within",
            kCheckedSpeed));
      }
    } catch (const ConfigError& error) {
      check->defects.push_back(fmt::format("the walk refuses these legs: {}", error.what()));
    }
  }
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const robot::MotorModel& motor = model.motors()[j];
    const auto i = static_cast<Eigen::Index>(j);
    check->loads.push_back({.joint = model.joints()[j].name,
                            .limit = robot::PeakTorque(model, j),
                            .rated = motor.torque_per_ampere() * motor.rated_current,
                            .double_support = both[i],
                            .single_support = single ? (*single)[i] : kNone,
                            .step = step ? step->torque[i] : kNone,
                            .step_rms = step ? step->rms[i] : kNone,
                            .step_velocity = step ? step->velocity[i] : kNone,
                            .velocity_limit = model.joints()[j].velocity_limit});
  }
}

double ReachAlong(const RobotCheck& check, const Vector3d& direction) {
  const robot::PostureGoal stance = StanceGoal(check);
  const auto reaches = [&](double distance) {
    robot::PostureGoal goal = stance;
    goal.foot[robot::Foot::kLeft].translation() += distance * direction;
    goal.com_xy += 0.5 * distance * direction.head<2>();
    return TrySolve(check.model, goal).has_value();
  };
  double reached = 0, missed = kLongestReach;
  // Outwards from the stance, so that a posture beyond an unreachable stretch does not count.
  for (double distance = 0.1; distance < kLongestReach; distance += 0.1) {
    if (!reaches(distance)) {
      missed = distance;
      break;
    }
    reached = distance;
  }
  while (missed - reached > kReachStep) {
    const double middle = 0.5 * (reached + missed);
    (reaches(middle) ? reached : missed) = middle;
  }
  return reached;
}

void FindSoles(const Robot& description, RobotCheck* check) {
  for (int f = 0; f < description.foot_size(); ++f) {
    const robot::FootModel& foot = check->model.feet()[static_cast<size_t>(f)];
    SoleFacts facts{.foot = foot.name,
                    .inner_radius = robot::InnerRadius(foot),
                    .guessed = description.foot(f).guessed()};
    const balance::ConvexPolygon polygon = balance::SolePolygon(foot, 0);
    facts.corners.assign(polygon.corners().begin(), polygon.corners().end());
    for (size_t i = 0; i < facts.corners.size(); ++i) {
      facts.area += 0.5 * Cross(facts.corners[i], facts.corners[(i + 1) % facts.corners.size()]);
    }
    check->soles.push_back(std::move(facts));
  }
}

/// m, from `point` inside to the polygon's edge along the unit vector `along`.
double DistanceToEdge(const balance::ConvexPolygon& polygon, const Vector2d& point,
                      const Vector2d& along) {
  double least = HUGE_VAL;
  const balance::HalfPlanes edges = balance::EdgesOf(polygon);
  for (const balance::HalfPlane& edge : edges.planes()) {
    const double rate = edge.normal.dot(along);
    if (rate > 0) least = std::min(least, (edge.offset - edge.normal.dot(point)) / rate);
  }
  return std::isfinite(least) ? std::max(least, 0.0) : 0;
}

void FindPushes(RobotCheck* check) {
  const RobotModel& model = check->model;
  const robot::RobotData data = Evaluate(model, check->stance);
  const std::array<balance::ConvexPolygon, 2> sole{balance::SolePolygon(model.feet()[0], 0),
                                                   balance::SolePolygon(model.feet()[1], 0)};
  const auto impulse = [&](std::array<bool, 2> in_contact, const Vector2d& com,
                           const Vector2d& along) {
    const balance::ContactGeometry geometry{{data.foot_pose[0], data.foot_pose[1]}, in_contact};
    const auto soles = balance::SupportPolygon(Eigen::Isometry3d::Identity(), geometry, sole);
    return model.total_mass() * check->frequency * DistanceToEdge(soles, com, along);
  };
  for (int i = 0; i < kDirections; ++i) {
    PushLimit push{.direction = 2 * pi * i / kDirections};
    const Vector2d along(std::cos(push.direction), std::sin(push.direction));
    push.both = impulse({true, true}, data.com.head<2>(), along);
    push.right = impulse({true, false}, data.foot_pose[0].translation().head<2>(), along);
    push.left = impulse({false, true}, data.foot_pose[1].translation().head<2>(), along);
    check->pushes.push_back(push);
  }
}

void FindLoops(RobotCheck* check) {
  const RobotModel& model = check->model;
  check->gains = balance::GainsByRule(model, kCheckedTick);
  const auto add = [&](const char* support, const std::array<bool, 2>& in_contact) {
    const auto poles =
        balance::ComputeClosedLoopPoles(model, check->gains, in_contact, kCheckedTick);
    LoopFacts facts{.support = support, .stable = poles.stable()};
    facts.gain_margin = balance::GainMargin(model, check->gains, in_contact, kCheckedTick);
    facts.delay_margin = balance::DelayMargin(model, check->gains, in_contact, kCheckedTick);
    facts.least_damping = 1;
    if (!poles.modes.empty()) facts.slowest = -poles.modes.front().s.real();
    for (const auto& mode : poles.modes) {
      if (mode.damping >= facts.least_damping) continue;
      facts.least_damping = mode.damping;
      facts.frequency = mode.frequency;
    }
    check->loops.push_back(facts);
  };
  add("both feet", {true, true});
  if (check->stands_on_one_foot) add("right foot", {true, false});
}

void FindDefects(RobotCheck* check) {
  const RobotModel& model = check->model;
  if (model.total_mass() > kMostDensity * std::pow(check->com_height, 3)) {
    check->defects.push_back(fmt::format(
        "it weighs {:.3g} kg with its COM {:.3g} m above the soles: correct masses that are in g",
        model.total_mass(), check->com_height));
  }
  for (size_t j = 0; j < model.joints().size(); ++j) {
    const robot::Joint& joint = model.joints()[j];
    const JointLoad& load = check->loads[j];
    const double position = check->stance.joint_position[static_cast<Eigen::Index>(j)];
    const double worst = std::fmax(load.double_support, load.single_support);
    if (worst > load.limit) {
      check->defects.push_back(fmt::format(
          "joint {} needs {:.3g} N·m to stand and may give {:.3g}: correct effort, gear, "
          "torque_constant or peak_current",
          joint.name, worst, load.limit));
    } else if (load.step > load.limit) {
      check->defects.push_back(fmt::format(
          "joint {} needs {:.3g} N·m in a step at {} m/s and may give {:.3g}: correct effort or "
          "friction, or give a narrower stance",
          joint.name, load.step, kCheckedSpeed, load.limit));
    } else if (load.double_support > load.rated) {
      check->defects.push_back(
          fmt::format("joint {} needs {:.3g} N·m to stand on both feet, more than its motor bears "
                      "for good ({:.3g}): correct rated_current, or straighten the stance",
                      joint.name, load.double_support, load.rated));
    } else if (load.step_rms > load.rated) {
      check->defects.push_back(fmt::format(
          "joint {} needs {:.3g} N·m while it walks at {} m/s (root mean square), more than its "
          "motor bears for good ({:.3g}): correct rated_current",
          joint.name, load.step_rms, kCheckedSpeed, load.rated));
    }
    if (load.step_velocity > load.velocity_limit) {
      check->defects.push_back(fmt::format(
          "joint {} turns at {:.3g} rad/s in a step at {} m/s that turns at {} rad/s, and may turn "
          "at {:.3g}: correct its velocity limit",
          joint.name, load.step_velocity, kCheckedSpeed, kCheckedTurn, load.velocity_limit));
    }
    const double room = std::min(position - joint.lower, joint.upper - position);
    if (room < kAtLimit && joint.upper > joint.lower) {
      check->defects.push_back(
          fmt::format("joint {} stands {:.3g} rad from the end of its range: give another stance",
                      joint.name, std::max(room, 0.0)));
    }
    if (!(joint.velocity_limit > 0)) {
      check->defects.push_back(
          fmt::format("joint {} has a velocity limit of {} rad/s: give the URDF's limit a velocity",
                      joint.name, joint.velocity_limit));
    }
  }
  for (const LoopFacts& loop : check->loops) {
    if (loop.stable) continue;
    check->defects.push_back(fmt::format(
        "on {} no gain of the rule holds it: gears or rotors ring at {:.0f} Hz; correct "
        "gear_stiffness, gear_damping, rotor_inertia or sensor_delay",
        loop.support, loop.frequency));
  }
  if (!check->stands_on_one_foot) {
    check->defects.push_back(
        "no posture puts the COM above one foot: the ranges of hip and ankle roll are too small, "
        "or the stance is too high");
  }
}

std::string Centimetres(double metres) { return fmt::format("{:.1f} cm", 100 * metres); }

std::string FormatLoads(const RobotCheck& check, int columns) {
  constexpr double kShown = 0.1;  // share of the limit
  std::vector<TableRow> rows{{"torque, N·m", "both feet", "one foot", "a step", "rated", "limit"}};
  size_t left_out = 0;
  for (const JointLoad& load : check.loads) {
    const double worst = std::fmax(load.double_support, std::fmax(load.single_support, load.step));
    if (worst < kShown * load.limit) {
      ++left_out;
      continue;
    }
    const auto cell = [&](double torque) {
      if (std::isnan(torque)) return TableCell("–");
      const Tone tone = torque > load.limit ? Tone::kBad : Tone::kPlain;
      return TableCell(fmt::format("{:.1f} ({:.0f} %)", torque, 100 * torque / load.limit), tone);
    };
    rows.push_back({load.joint, cell(load.double_support), cell(load.single_support),
                    cell(load.step), FormatNumber(load.rated), FormatNumber(load.limit)});
  }
  std::string text = FormatColumns(rows, columns);
  if (left_out > 0)
    text += fmt::format("{} joints need less than a tenth of their limit\n", left_out);
  return text;
}

std::string FormatLoops(const RobotCheck& check, int columns) {
  std::vector<TableRow> rows{
      {"closed loop", "stable", "gain margin", "delay margin", "slowest", "least damped"}};
  for (const LoopFacts& loop : check.loops) {
    rows.push_back({loop.support,
                    TableCell(loop.stable ? "yes" : "no", loop.stable ? Tone::kPlain : Tone::kBad),
                    loop.gain_margin < balance::kMostGain ? fmt::format("{:.2f}", loop.gain_margin)
                                                          : fmt::format("≥ {}", balance::kMostGain),
                    fmt::format("{}{} ticks", loop.delay_margin < balance::kMostDelay ? "" : "≥ ",
                                loop.delay_margin),
                    fmt::format("{:.2g} 1/s", loop.slowest),
                    fmt::format("{:.2g} at {:.1f} Hz", loop.least_damping, loop.frequency)});
  }
  return FormatColumns(rows, columns);
}

std::string FormatPushes(const RobotCheck& check, int columns) {
  std::vector<TableRow> rows{{"largest push m ω d, N·s", "both feet", "right foot", "left foot"}};
  constexpr std::array kNames = {"forwards",  "front left", "to the left",  "back left",
                                 "backwards", "back right", "to the right", "front right"};
  for (size_t i = 0; i < check.pushes.size(); i += 2) {  // JSON has those between
    const PushLimit& push = check.pushes[i];
    rows.push_back({kNames[i / 2], fmt::format("{:.1f}", push.both),
                    fmt::format("{:.1f}", push.right), fmt::format("{:.1f}", push.left)});
  }
  return FormatColumns(rows, columns);
}

}  // namespace

RobotCheck CheckRobot(const std::filesystem::path& file) {
  RobotCheck check;
  check.file = file.string();
  const robot::RobotFiles files = robot::ReadRobotFiles(check.file);
  check.model = files.Model(&check.left_out);
  check.maker_file = files.maker_file;
  try {
    check.stance = SolveStart(check.model, StartPosture());
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: stance: {}", check.file, error.what()));
  }
  const robot::RobotData data = Evaluate(check.model, check.stance);
  check.com_height = data.com.z() - data.foot_pose[0].translation().z();
  check.frequency = std::sqrt(robot::kGravity / check.com_height);
  check.foot_spacing = data.foot_pose[1].translation().y() - data.foot_pose[0].translation().y();
  FindSoles(files.description, &check);
  FindLoads(&check);
  check.reach = {ReachAlong(check, Vector3d::UnitX()), ReachAlong(check, -Vector3d::UnitX()),
                 ReachAlong(check, Vector3d::UnitY()), ReachAlong(check, Vector3d::UnitZ())};
  FindPushes(&check);
  try {
    FindLoops(&check);
  } catch (const robot::RobotError& error) {
    check.defects.push_back(fmt::format("the closed loop: {}", error.what()));
  }
  FindDefects(&check);
  return check;
}

std::string FormatRobotCheck(const RobotCheck& check, int columns) {
  const RobotModel& model = check.model;
  const robot::DriveTrainModel& drive = model.drive_train();
  std::string text = Toned(
      fmt::format("{}: {} joints, {:.1f} kg", model.name(), model.num_joints(), model.total_mass()),
      Tone::kStrong);
  const auto line = [&](const char* name, const std::string& value) {
    text += "\n" + Wrapped(fmt::format("  {:<8} {}", name, value), columns, 11);
  };
  line("file", check.file);
  line("stance", fmt::format("COM {} above the soles, ω {:.2f} rad/s, soles {} apart",
                             Centimetres(check.com_height), check.frequency,
                             Centimetres(check.foot_spacing)));
  for (const SoleFacts& sole : check.soles) {
    line(&sole == &check.soles.front() ? "soles" : "",
         fmt::format("{}: {} corners, {:.0f} cm², nearest edge {} from the origin{}", sole.foot,
                     sole.corners.size(), 1e4 * sole.area, Centimetres(sole.inner_radius),
                     sole.guessed ? ": a guess" : ""));
  }
  line("reach", fmt::format("left foot {} forwards, {} back, {} outwards, {} up",
                            Centimetres(check.reach.forward), Centimetres(check.reach.back),
                            Centimetres(check.reach.outward), Centimetres(check.reach.up)));
  line("drives", fmt::format("{}, readings {} ms old",
                             drive.gear_stiffness > 0
                                 ? fmt::format("gears of {:.3g} N·m/rad", drive.gear_stiffness)
                                 : "rigid gears",
                             FormatNumber(1e3 * drive.sensor_delay)));
  line("gains",
       fmt::format("by rule: COM {:.3g} 1/s², {:.3g} 1/s", check.gains.com.kp, check.gains.com.kd));
  text += "\n\n" + FormatLoads(check, columns) + "\n" + FormatPushes(check, columns) + "\n" +
          FormatLoops(check, columns) + "\n";
  if (!check.left_out.empty()) {
    text +=
        Wrapped(fmt::format("left out of the maker's file: {}", fmt::join(check.left_out, "; ")),
                columns, 2) +
        "\n";
  }
  if (check.ok()) return text + Toned("no defect was found", Tone::kGood) + "\n";
  text +=
      Toned(fmt::format("{} defect{}", check.defects.size(), check.defects.size() == 1 ? "" : "s"),
            Tone::kBad);
  for (const std::string& defect : check.defects) {
    text += "\n" + Wrapped("  - " + defect, columns, 4);
  }
  return text + "\n";
}

Json RobotCheckJson(const RobotCheck& check) {
  Json json;
  json["name"] = check.model.name();
  json["file"] = check.file;
  json["joints"] = check.model.num_joints();
  json["mass"] = check.model.total_mass();
  json["com_height"] = check.com_height;
  json["frequency"] = check.frequency;
  json["foot_spacing"] = check.foot_spacing;
  json["gear_stiffness"] = check.model.drive_train().gear_stiffness;
  json["sensor_delay"] = check.model.drive_train().sensor_delay;
  json["soles"] = Json::array();
  for (const SoleFacts& sole : check.soles) {
    Json corners = Json::array();
    for (const Vector2d& corner : sole.corners) corners.push_back({corner.x(), corner.y()});
    json["soles"].push_back({{"foot", sole.foot},
                             {"corners", std::move(corners)},
                             {"area", sole.area},
                             {"inner_radius", sole.inner_radius},
                             {"guessed", sole.guessed}});
  }
  json["reach"] = {{"forward", check.reach.forward},
                   {"back", check.reach.back},
                   {"outward", check.reach.outward},
                   {"up", check.reach.up}};
  json["stands_on_one_foot"] = check.stands_on_one_foot;
  json["torque"] = Json::array();
  for (const JointLoad& load : check.loads) {
    json["torque"].push_back({{"joint", load.joint},
                              {"double_support", load.double_support},
                              {"single_support", load.single_support},
                              {"step", load.step},
                              {"step_rms", load.step_rms},
                              {"rated", load.rated},
                              {"limit", load.limit},
                              {"step_velocity", load.step_velocity},
                              {"velocity_limit", load.velocity_limit}});
  }
  json["push"] = Json::array();
  for (const PushLimit& push : check.pushes) {
    json["push"].push_back({{"direction", push.direction},
                            {"double_support", push.both},
                            {"right_foot", push.right},
                            {"left_foot", push.left}});
  }
  json["gains"] = {{"com_kp", check.gains.com.kp}, {"com_kd", check.gains.com.kd}};
  json["closed_loop"] = Json::array();
  for (const LoopFacts& loop : check.loops) {
    json["closed_loop"].push_back({{"support", loop.support},
                                   {"stable", loop.stable},
                                   {"gain_margin", loop.gain_margin},
                                   {"delay_margin", loop.delay_margin},
                                   {"slowest", loop.slowest},
                                   {"least_damping", loop.least_damping},
                                   {"least_damped_frequency", loop.frequency}});
  }
  json["left_out"] = check.left_out;
  json["defects"] = check.defects;
  return json;
}

}  // namespace poise
