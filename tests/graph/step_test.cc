// A robot that steps stands where no centre of pressure within its feet can stop it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "logging/log_messages.h"
#include "logging/run_record.h"
#include "operate/message_traits.hpp"
#include "tests/graph/poise_program.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

/// The measured value of a check.
double Measured(const nlohmann::json& summary, const std::string& name) {
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == name) return check["measured"].get<double>();
  }
  ADD_FAILURE() << "no check " << name;
  return 0;
}

/// The same push with steps, and without: then it is a fall.
void ExpectStands(const std::string& scenario, const std::string& world) {
  const RunFolder folder;
  const std::vector<std::string> push = {"run",     scenario, "--variant", "step",
                                         "--world", world,    "--inline",  "--no-reference"};
  std::vector<std::string> steps = push, stays = push;
  steps.insert(steps.end(), {"--out", folder / "steps"});
  const ProgramResult with = RunPoise(steps);
  EXPECT_EQ(with.exit_code, 0) << with.output;
  const nlohmann::json summary = ReadSummary(folder / "steps");
  EXPECT_GE(Measured(summary, "steps"), 1);
  EXPECT_GT(Measured(summary, "foothold_margin_min"), 0);
  // The screen tells of the step, and not of how far the COM was from a reference that it leads.
  const std::string said = std::regex_replace(with.output, std::regex("\\s+"), " ");
  EXPECT_NE(said.find("foot was told to step at"), std::string::npos) << said;
  EXPECT_NE(said.find("moved by up to"), std::string::npos) << said;
  EXPECT_EQ(said.find("strayed"), std::string::npos) << said;
  EXPECT_NE(said.find(scenario + ", variant step"), std::string::npos) << said;
  // The foot is down after the decision, not before half of the least swing of 0.12 s.
  const double swing = Measured(summary, "step_touch_down") - Measured(summary, "step_decision");
  EXPECT_GT(swing, 0.06);
  EXPECT_LT(swing, 0.8);
  stays.insert(stays.end(),
               {"--out", folder / "stays", "--set", "step_planner.recovery.enabled=false"});
  const ProgramResult without = RunPoise(stays);
  EXPECT_EQ(without.exit_code, 1) << without.output;
  EXPECT_NE(without.output.find("fell"), std::string::npos) << without.output;
}

TEST(Step, CatchesAPushOnBothFeet) {
  for (const char* world : {"ode", "mujoco"}) ExpectStands("push_double_support", world);
}

TEST(Step, CatchesAPushOnOneFoot) {
  for (const char* world : {"ode", "mujoco"}) ExpectStands("push_single_support", world);
}

// A robot without foot sensors, gains by rule. The variant's margin and filters were chosen on it,
// and 0.15 m √(g h) is near the most that it stands: from 15 of 16 directions in each engine.
TEST(Step, CatchesPushesOnAnotherRobotWithoutFootSensors) {
  constexpr int kDirections = 8, kLeast = 7;
  for (const char* world : {"ode", "mujoco"}) {
    int standing = 0;
    for (int i = 0; i < kDirections; ++i) {
      const bool ahead_or_behind = i % (kDirections / 2) == 0;
      const double angle = 2 * M_PI * i / kDirections;
      for (const bool steps : {true, false}) {
        if (!steps && !ahead_or_behind) continue;
        const RunFolder folder;
        const ProgramResult result = RunPoise(
            {"run", "push", "--variant", "step", "--robot", "heron/heron", "--world", world,
             "--inline", "--no-reference", "--set",
             fmt::format("sim.push[0].direction_x={:.6f}", std::cos(angle)), "--set",
             fmt::format("sim.push[0].direction_y={:.6f}", std::sin(angle)), "--set",
             fmt::format("step_planner.recovery.enabled={}", steps), "--out", folder / "run"});
        ASSERT_LE(result.exit_code, 1) << world << ' ' << i << result.output;
        if (!steps) {
          EXPECT_EQ(result.exit_code, 1) << world << ' ' << i << result.output;
          continue;
        }
        standing += result.exit_code == 0;
        if (ahead_or_behind && result.exit_code == 0) {
          EXPECT_GE(Measured(ReadSummary(folder / "run"), "steps"), 1) << world << ' ' << i;
        }
      }
    }
    EXPECT_GE(standing, kLeast) << world;
  }
}

Eigen::Isometry3d PoseOf(const pose_t& pose) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translation() = Eigen::Vector3d(pose.position[0], pose.position[1], pose.position[2]);
  const double* q = pose.orientation;
  frame.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  return frame;
}

/// m between the true soles, seen from above; negative: one is above the other.
double BetweenSoles(const ground_truth_t& truth, double length, double width) {
  std::array<std::array<Eigen::Vector2d, 4>, 2> corner;
  std::array<Eigen::Vector2d, 4> axis;
  for (size_t f = 0; f < 2; ++f) {
    const Eigen::Isometry3d sole = PoseOf(truth.foot_pose[f]);
    for (size_t k = 0; k < 4; ++k) {
      const double x = k % 2 == 0 ? 0.5 * length : -0.5 * length;
      const double y = k / 2 == 0 ? 0.5 * width : -0.5 * width;
      corner[f][k] = (sole * Eigen::Vector3d(x, y, 0)).head<2>();
    }
    for (size_t k = 0; k < 2; ++k) {
      axis[2 * f + k] = sole.linear().col(static_cast<int>(k)).head<2>().normalized();
    }
  }
  // Convex figures are apart along one of their sides' normals, or not at all.
  double apart = -1;
  for (const Eigen::Vector2d& along : axis) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (size_t f = 0; f < 2; ++f) {
      for (const Eigen::Vector2d& point : corner[f]) {
        low[f] = std::min(low[f], along.dot(point));
        high[f] = std::max(high[f], along.dot(point));
      }
    }
    apart = std::max({apart, low[1] - high[0], low[0] - high[1]});
  }
  return apart;
}

double LeastBetweenSoles(const logging::RunRecord& run) {
  double least = 1;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    least = std::min(least, BetweenSoles(*run.truth.at(tick), 0.30, 0.15));
  }
  return least;
}

// On the right foot, pushed ahead and behind, half as hard again as the pendulum with its centre of
// pressure at the toes stands: the left foot goes around the right one and comes down in line.
TEST(Step, GoesAroundTheStandingLegOnOneFoot) {
  for (const char* world : {"ode", "mujoco"}) {
    for (const char* ahead : {"1", "-1"}) {
      const RunFolder folder;
      const ProgramResult result = RunPoise(
          {"run", "push_single_support", "--variant", "step", "--world", world, "--inline",
           "--no-reference", "--set", std::string("sim.push[0].direction_x=") + ahead, "--set",
           "sim.push[0].direction_y=0", "--set", "sim.push[0].peak=420", "--out", folder / "run"});
      EXPECT_EQ(result.exit_code, 0) << world << ' ' << ahead << result.output;
      const logging::RunRecord run = logging::ReadRun(folder / "run/run.lcm");
      EXPECT_GT(LeastBetweenSoles(run), 0) << world << ' ' << ahead;
      const Eigen::Isometry3d right = PoseOf(run.truth.at(run.num_ticks - 1)->foot_pose[0]);
      const Eigen::Vector3d left =
          right.inverse() * PoseOf(run.truth.at(run.num_ticks - 1)->foot_pose[1]).translation();
      EXPECT_GT(std::abs(left.x()), 0.3) << world << ' ' << ahead;
      EXPECT_LT(std::abs(left.y()), 0.15) << world << ' ' << ahead;
    }
  }
}

// A step ahead, rest, and the feet as they stood before once an operator asks for it.
TEST(Step, TheFeetComeSideBySideWhenAskedTo) {
  constexpr double kAsked = 6;  // s
  for (const char* world : {"ode", "mujoco"}) {
    const RunFolder folder;
    const ProgramResult result =
        RunPoise({"run", "push_double_support", "--variant", "step", "--world", world, "--inline",
                  "--no-reference", "--duration", "12", "--set", "sim.push[0].peak=380", "--out",
                  folder / "run"});
    EXPECT_EQ(result.exit_code, 0) << world << result.output;
    const logging::LogMessages log(folder / "run/run.lcm");
    const RunSpec& spec = log.spec();
    operate::act_t act{};
    act.run_id = spec.run_id();
    act.tick = std::lround(kAsked / spec.tick_period());
    act.id = 1;
    act.kind = operate::act_t::KIND_STAND;
    while (spec.graph().component(act.component).name() != "step_planner") ++act.component;
    std::vector<uint8_t> bytes(static_cast<size_t>(act.getEncodedSize()));
    ASSERT_GT(act.encode(bytes.data(), 0, act.getEncodedSize()), 0);
    planner_status_t planner{};
    ground_truth_t truth{};
    double least = 1;
    InlineRunner runner(spec, Components());
    runner.set_tap([&](int channel, const OutputPort& output, const Tick&) {
      const std::string& name = spec.graph().channel(channel).name();
      if (name == "PLANNER_STATUS") {
        planner = *static_cast<const planner_status_t*>(output.message());
      }
      if (name != "GROUND_TRUTH") return;
      truth = *static_cast<const ground_truth_t*>(output.message());
      least = std::min(least, BetweenSoles(truth, 0.30, 0.15));
    });
    runner.Run(act.tick);
    EXPECT_NE(planner.step_reason, planner_status_t::REASON_NONE) << world;
    EXPECT_EQ(planner.stepping, planner_status_t::STEPPING_NONE) << world;
    EXPECT_TRUE(runner.Inject("OPERATOR_ACT", bytes));
    runner.Run(spec.num_ticks() - act.tick);
    EXPECT_EQ(planner.step_reason, planner_status_t::REASON_TOGETHER) << world;
    EXPECT_EQ(planner.stepping, planner_status_t::STEPPING_NONE) << world;
    const Eigen::Vector3d left =
        PoseOf(truth.foot_pose[0]).inverse() * PoseOf(truth.foot_pose[1]).translation();
    EXPECT_NEAR(left.x(), 0, 0.05) << world;
    EXPECT_NEAR(left.y(), 0.21, 0.03) << world;
    EXPECT_GT(least, 0) << world;
  }
}

}  // namespace
}  // namespace poise
