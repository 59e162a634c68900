// A walk from start to stop in both engines, and its replay.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "logging/run_record.h"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

double Measured(const nlohmann::json& summary, const std::string& name) {
  for (const nlohmann::json& check : summary["checks"]) {
    if (check["name"] == name) return check["measured"].get<double>();
  }
  ADD_FAILURE() << "no check " << name;
  return 0;
}

/// A metre ahead, and the feet side by side.
const std::vector<std::string> kOneMetre = {"--set",      "step_planner.walk.command[1].time=11",
                                            "--set",      "step_planner.walk.command[1].stop=true",
                                            "--set",      "step_planner.walk.command[2].stop=true",
                                            "--duration", "17"};

TEST(WalkRun, AMetreAndAStopInEachEngine) {
  for (const std::string engine : {"mujoco", "ode"}) {
    const RunFolder folder;
    std::vector<std::string> arguments = {"run",  "walk",  "--inline",    "--world",
                                          engine, "--out", folder / "run"};
    arguments.insert(arguments.end(), kOneMetre.begin(), kOneMetre.end());
    const ProgramResult result = RunPoise(arguments);
    EXPECT_EQ(result.exit_code, 0) << engine << result.output;
    const nlohmann::json summary = ReadSummary(folder / "run");
    EXPECT_EQ(Measured(summary, "fallen"), 0) << engine;
    EXPECT_EQ(Measured(summary, "violated_ticks"), 0) << engine;
    // 10 s in steps of 1.3 √(h/g).
    EXPECT_NEAR(Measured(summary, "steps"), 29, 4) << engine;
    const std::string told =
        "It walked " + std::to_string(std::lround(Measured(summary, "steps"))) + " steps";
    std::string words = result.output;
    std::replace(words.begin(), words.end(), '\n', ' ');
    EXPECT_NE(words.find(told), std::string::npos) << result.output;
    EXPECT_EQ(words.find("strayed"), std::string::npos) << result.output;
    EXPECT_GT(Measured(summary, "walk_course_share"), 70) << engine;
    EXPECT_GT(Measured(summary, "walk_way"), 0.8) << engine;
    if (engine == "ode") continue;
    const ProgramResult replay = RunPoise({"replay", folder / "run"});
    EXPECT_EQ(replay.exit_code, 0) << replay.output;
  }
}

// Ahead at 0.4 m/s, in a curve, aside and back.
TEST(WalkRun, FastInEachEngine) {
  for (const std::string engine : {"mujoco", "ode"}) {
    const RunFolder folder;
    const ProgramResult result = RunPoise({"run", "walk", "--variant", "fast", "--inline",
                                           "--world", engine, "--out", folder / "run"});
    EXPECT_EQ(result.exit_code, 0) << engine << result.output;
    const nlohmann::json summary = ReadSummary(folder / "run");
    EXPECT_EQ(Measured(summary, "fallen"), 0) << engine;
    EXPECT_GT(Measured(summary, "walk_speed_max"), 0.3) << engine;
    EXPECT_GT(Measured(summary, "walk_turn_share"), 60) << engine;
    if (engine == "ode") continue;
    const ProgramResult replay = RunPoise({"replay", folder / "run"});
    EXPECT_EQ(replay.exit_code, 0) << replay.output;
  }
}

// The paper's robot takes a push of 0.08 m √(g h) from each of four sides without a fall.
TEST(WalkRun, APushInAWalkMovesTheFeet) {
  for (const char* side : {"1,0", "0,1", "-1,0", "0,-1"}) {
    const std::string direction = side;
    const size_t comma = direction.find(',');
    const RunFolder folder;
    const ProgramResult result =
        RunPoise({"run",       "walk",
                  "--variant", "ahead",
                  "--inline",  "--no-reference",
                  "--out",     folder / "run",
                  "--set",     "sim.push[0].start=5",
                  "--set",     "sim.push[0].duration=0.1",
                  "--set",     "sim.push[0].at_body=true",
                  "--set",     "sim.push[0].profile=HALF_SINE",
                  "--set",     "sim.push[0].scaled_impulse=0.08",
                  "--set",     "sim.push[0].direction_x=" + direction.substr(0, comma),
                  "--set",     "sim.push[0].direction_y=" + direction.substr(comma + 1)});
    EXPECT_EQ(result.exit_code, 0) << side << result.output;
  }
}

/// rad, of the true sole against the ground.
double Tilt(const pose_t& sole) {
  const double* const q = sole.orientation;
  return std::acos(std::clamp(1 - 2 * (q[1] * q[1] + q[2] * q[2]), -1.0, 1.0));
}

// What friction would tilt by 3.7 degrees, on their way down and under load: of the robot that has
// it, where a fifth of it is not compensated, and of the ideal one, which has none.
TEST(WalkRun, SolesComeDownFlatAndStaySo) {
  for (const char* robot : {"--quiet", "--ideal"}) {
    const RunFolder folder;
    std::vector<std::string> arguments = {"run",    "walk",  "--inline",     "--world",
                                          "mujoco", "--out", folder / "run", robot};
    arguments.insert(arguments.end(), kOneMetre.begin(), kOneMetre.end());
    const ProgramResult result = RunPoise(arguments);
    EXPECT_EQ(result.exit_code, 0) << robot << result.output;
    const logging::RunRecord run = logging::ReadRun(folder / "run/run.lcm");
    int landings = 0;
    double landed = 0, loaded = 0;  // rad, largest
    for (int64_t tick = 1; tick < run.num_ticks; ++tick) {
      const support_plan_t *const before = run.plan.at(tick - 1), *const plan = run.plan.at(tick);
      const ground_truth_t* const truth = run.truth.at(tick);
      if (before == nullptr || plan == nullptr || truth == nullptr) continue;
      for (size_t f = 0; f < 2; ++f) {
        const double tilt = Tilt(truth->foot_pose[f]);
        if (plan->in_contact[f] != 0 && before->in_contact[f] == 0) {
          ++landings;
          landed = std::max(landed, tilt);
        }
        if (plan->transition == support_plan_t::TRANSITION_LOADING &&
            plan->transition_foot == static_cast<int>(f)) {
          loaded = std::max(loaded, tilt);
        }
      }
    }
    EXPECT_GE(landings, 9) << robot;
    const bool ideal = std::string(robot) == "--ideal";
    EXPECT_LT(landed, ideal ? 0.002 : 0.02) << robot;
    EXPECT_LT(loaded, ideal ? 0.01 : 0.035) << robot;
  }
}

/// What a walk of a metre is judged by in any robot.
void ExpectWalks(const std::string& robot, const std::string& engine) {
  const RunFolder folder;
  std::vector<std::string> arguments = {"run",     "walk", "--inline", "--robot",     robot,
                                        "--world", engine, "--out",    folder / "run"};
  arguments.insert(arguments.end(), kOneMetre.begin(), kOneMetre.end());
  const ProgramResult result = RunPoise(arguments);
  EXPECT_EQ(result.exit_code, 0) << robot << ", " << engine << result.output;
  const nlohmann::json summary = ReadSummary(folder / "run");
  for (const char* none : {"fallen", "violated_ticks", "eta_infeasible_ticks"}) {
    EXPECT_EQ(Measured(summary, none), 0) << robot << ", " << engine << ": " << none;
  }
  EXPECT_GE(Measured(summary, "steps"), 25) << robot << ", " << engine;
  EXPECT_GT(Measured(summary, "walk_way"), 0.6) << robot << ", " << engine;
  EXPECT_GT(Measured(summary, "walk_course_share"), 70) << robot << ", " << engine;
}

// No sensors in its feet, soft gears, arms.
TEST(WalkRun, HeronWalksInEachEngine) {
  for (const char* engine : {"mujoco", "ode"}) ExpectWalks("heron/heron", engine);
}

/// A folder with a public robot's text and its maker's file; empty: that file is not there.
std::string PublicRobot(const std::string& name, const std::string& urdf, const RunFolder& folder) {
  const char* const given = std::getenv("POISE_ROBOTS");
  const std::filesystem::path robots =
      given != nullptr ? given : POISE_SOURCE_DIR "/../shared/robots";
  if (!std::filesystem::exists(robots / urdf)) return {};
  const std::filesystem::path place = folder / name;
  std::filesystem::create_directories(place);
  std::filesystem::copy_file(robots / urdf, place / urdf);
  const std::string text = name + ".pbtxt";
  std::filesystem::copy_file(POISE_SOURCE_DIR "/deploy/robots/" + name + "/" + text, place / text);
  return place / text;
}

// A COM at 0.46 m, and knees that come to their largest torque in some ticks: with the COM as low
// as others have it, it fell.
TEST(WalkRun, ASmallRobotWalks) {
  const RunFolder folder;
  const std::string robot = PublicRobot("icub", "icub_reduced.urdf", folder);
  if (robot.empty()) GTEST_SKIP() << "icub_reduced.urdf is not there: it is not part of Poise";
  ExpectWalks(robot, "mujoco");
}

// Soles 50 to 60 mm wide without sensors: it stood on a sole's edge while that was loaded.
TEST(WalkRun, ARobotWithNarrowSolesWalks) {
  const RunFolder folder;
  const std::string robot = PublicRobot("g1", "g1_29dof_rev_1_0.urdf", folder);
  if (robot.empty()) GTEST_SKIP() << "g1_29dof_rev_1_0.urdf is not there: it is not part of Poise";
  ExpectWalks(robot, "mujoco");
}

// Seven steps on stairs and a stand with a foot on each of two treads, of which one lies across the
// other's edge. The stretched leg fell off the stairs down at 13 s, the stand on two treads up.
TEST(WalkRun, UpAndDownStairsToAStandOnThem) {
  for (const std::string engine : {"mujoco", "ode"}) {
    for (const std::string way : {"up", "down"}) {
      const RunFolder folder;
      std::vector<std::string> arguments = {
          "run",        "walk_stairs", "--inline",
          "--world",    engine,        "--out",
          folder / way, "--set",       "step_planner.walk.command[1].time=20",
          "--duration", "30"};
      if (way == "down") arguments.insert(arguments.end(), {"--variant", "down"});
      // Its exit code: the scenario asks for 20 steps.
      const std::string output = RunPoise(arguments).output;
      EXPECT_EQ(output.find("is walked at"), std::string::npos) << output;
      const nlohmann::json summary = ReadSummary(folder / way);
      EXPECT_EQ(Measured(summary, "fallen"), 0) << engine << way;
      EXPECT_EQ(Measured(summary, "violated_ticks"), 0) << engine << way;
      EXPECT_EQ(Measured(summary, "duration_reached"), 30) << engine << way;
      EXPECT_GE(Measured(summary, "steps"), 6) << engine << way;
      EXPECT_LE(Measured(summary, "steps"), 9) << engine << way;
    }
  }
}

// The stairs are not told of. With its feet side by side, one across an edge, it fell in 12 of 12.
TEST(WalkRun, UpAndDownStairsItIsNotToldOfToAStandOnThem) {
  for (const std::string engine : {"mujoco", "ode"}) {
    for (const std::string variant : {"stairs", "stairs_down"}) {
      const RunFolder folder;
      RunPoise({"run", "walk_blocks", "--variant", variant, "--inline", "--world", engine, "--out",
                folder / "run", "--set", "step_planner.walk.command[1].after_steps=7", "--duration",
                "40"});  // its exit code: the scenario asks for 20 steps
      const nlohmann::json summary = ReadSummary(folder / "run");
      EXPECT_EQ(Measured(summary, "fallen"), 0) << engine << variant;
      EXPECT_EQ(Measured(summary, "violated_ticks"), 0) << engine << variant;
      EXPECT_EQ(Measured(summary, "duration_reached"), 40) << engine << variant;
      EXPECT_GE(Measured(summary, "steps"), 7) << engine << variant;
    }
  }
}

}  // namespace
}  // namespace poise
