// What a robot is and what it can do, from its files alone: nothing is simulated.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "components/balance/gains/gain_rule.h"
#include "components/robot/robot_model.h"
#include "tools/robot/standing_loads.h"

namespace poise {

/// What one joint bears, N·m, unsigned.
struct JointLoad {
  std::string joint;
  double limit = 0;           ///< robot::PeakTorque
  double rated = 0;           ///< at the motor's rated current
  double double_support = 0;  ///< in the stance
  /// The worse of the two feet, where the robot stands on one, the COM above its sole's origin.
  /// NaN: it has no posture.
  double single_support = 0;
  double step = 0;            ///< the largest in a step (LoadsOfAStep); NaN: it has none
  double step_rms = 0;        ///< N·m, root of the mean square of steps; NaN likewise
  double step_velocity = 0;   ///< rad/s, the largest in a step; NaN likewise
  double velocity_limit = 0;  ///< rad/s
};

struct SoleFacts {
  std::string foot;
  std::vector<Eigen::Vector2d> corners = {};  ///< m, sole frame, anticlockwise
  double area = 0;                            ///< m²
  double inner_radius = 0;                    ///< m, robot::InnerRadius
  bool guessed = false;                       ///< Foot.guessed
};

/// How far the left foot can be put from where it stands, m, the COM midway between the feet at the
/// stance's height, within the joints' limits.
struct StepReach {
  double forward = 0, back = 0, outward = 0, up = 0;
};

/// The linear inverted pendulum's largest impulse m ω d, N·s, d the distance from the COM at rest
/// to the edge of the soles in contact along the push.
struct PushLimit {
  double direction = 0;                  ///< rad, 0 forwards, π/2 to the left
  double both = 0, right = 0, left = 0;  ///< by the feet in contact
};

/// The standing robot under its controller with the gains of the rule, on both feet or on the
/// right.
struct LoopFacts {
  std::string support;
  bool stable = false;
  double gain_margin = 0;    ///< largest factor on the feedback with which it stands, 4 at most
  int delay_margin = 0;      ///< ticks beyond the robot's own delay, 5 at most
  double slowest = 0;        ///< 1/s, decay of the slowest mode
  double least_damping = 0;  ///< of the modes that oscillate
  double frequency = 0;      ///< Hz, of that mode
};

struct RobotCheck {
  robot::RobotModel model;
  std::string file;         ///< the robot's text
  std::string maker_file;   ///< that it names
  double com_height = 0;    ///< m above the soles, in the stance
  double frequency = 0;     ///< rad/s, ω = √(g / com_height)
  double foot_spacing = 0;  ///< m
  std::vector<SoleFacts> soles;
  std::vector<JointLoad> loads;     ///< by joint
  bool stands_on_one_foot = false;  ///< a posture above one foot was found, for either foot
  StepReach reach;
  std::vector<PushLimit> pushes;      ///< 16 directions
  balance::StandingGains gains;       ///< by the rule, at kCheckedTick
  std::vector<LoopFacts> loops;       ///< those supports in which it can stand
  robot::RobotState stance;           ///< of the page
  std::vector<std::string> left_out;  ///< of the maker's file: import has told it
  std::vector<std::string> defects;   ///< what was found wrong, each with what to do
  bool ok() const { return defects.empty(); }
};

/// s, of the scenarios' 500 Hz.
inline constexpr double kCheckedTick = 0.002;

/// Reads and checks a robot; some seconds. Throws robot::RobotError, ConfigError: files that
/// make no robot, a stance out of reach.
RobotCheck CheckRobot(const std::filesystem::path& file);

/// For a terminal of `columns`.
std::string FormatRobotCheck(const RobotCheck& check, int columns);

/// The same figures in SI units.
nlohmann::ordered_json RobotCheckJson(const RobotCheck& check);

}  // namespace poise
