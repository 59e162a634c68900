// The pendulum's bound of a push, against an integrated pendulum.
#include "tools/scenario/push_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"

namespace poise {
namespace {

using std::numbers::pi;

constexpr double kDuration = 0.107;  // s

Scenario PushScenario(const std::string& push) {
  Scenario scenario;
  ParseTextProto("sim { push { start: 0.01 duration: 0.107 peak: 100 " + push + " } }", "test",
                 &scenario);
  return scenario;
}

/// The robot of the house with its COM 0.75 m high at (x, y), feet level at y = -0.1 and 0.1, each
/// bearing as told.
logging::RunRecord Standing(double x, double y, bool right = true, bool left = true) {
  logging::RunRecord run;
  run.robot =
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/deploy/robots/dyros/dyros_legs.pbtxt", nullptr);
  run.spec.set_tick_period(0.002);
  run.num_ticks = 6;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    ground_truth_t truth;
    truth.foot_pose.resize(2);
    truth.foot_contact_points = {right ? 4 : 0, left ? 4 : 0};
    for (size_t f = 0; f < 2; ++f) {
      pose_t& pose = truth.foot_pose[f];
      std::fill(std::begin(pose.position), std::end(pose.position), 0.0);
      pose.position[1] = f == 0 ? -0.1 : 0.1;
      pose.orientation[0] = 1;
      pose.orientation[1] = pose.orientation[2] = pose.orientation[3] = 0;
    }
    truth.com_position[0] = x;
    truth.com_position[1] = y;
    truth.com_position[2] = 0.75;
    std::fill(std::begin(truth.com_velocity), std::end(truth.com_velocity), 0.0);
    run.truth.Set(tick, truth);
  }
  return run;
}

/// True when a pendulum at rest, its CoP at the edge from the push's start on, comes back from a
/// half sine (or a rectangle) of `force` N: integrated in small steps, then judged by its capture
/// point.
bool PendulumSurvives(double force, bool half_sine, double mass, double height, double distance) {
  const double w2 = robot::kGravity / height;
  const int steps = 20000;
  const double h = kDuration / steps;
  double x = 0, v = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) * h;
    const double f = half_sine ? force * std::sin(pi * t / kDuration) : force;
    const auto acceleration = [&](double at) { return w2 * (at - distance) + f / mass; };
    const double middle = x + h / 2 * v;
    x += h * (v + h / 2 * acceleration(x));
    v += h * acceleration(middle);
  }
  return x + v / std::sqrt(w2) <= distance;
}

double LargestForce(bool half_sine, double mass, double height, double distance) {
  double low = 0, high = 1e4;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (PendulumSurvives(middle, half_sine, mass, height, distance) ? low : high) = middle;
  }
  return low;
}

TEST(PushBound, IsWhatAPendulumSurvives) {
  for (const bool half_sine : {true, false}) {
    const Scenario scenario = PushScenario(std::string("direction_y: 1 profile: ") +
                                           (half_sine ? "HALF_SINE" : "RECTANGLE"));
    const auto bound = FindPushBound(scenario, Standing(0, 0.02));
    ASSERT_TRUE(bound);
    const double force = LargestForce(half_sine, bound->mass, bound->height, bound->distance);
    const double impulse = force * kDuration * (half_sine ? 2 / pi : 1);
    EXPECT_NEAR(bound->lip_impulse_of_duration, impulse, 1e-4 * impulse);
    EXPECT_NEAR(bound->impulse, 100 * kDuration * (half_sine ? 2 / pi : 1), 1e-12);
    EXPECT_NEAR(bound->lip_impulse,
                bound->mass * std::sqrt(robot::kGravity / 0.75) * bound->distance, 1e-9);
    EXPECT_GT(bound->lip_impulse_of_duration, bound->lip_impulse);
  }
}

TEST(PushBound, TheShorterThePushTheNearerToAnImpulse) {
  for (const auto profile : {Push::HALF_SINE, Push::RECTANGLE}) {
    EXPECT_EQ(PendulumShare(profile, 0, 3.6), 1);
    EXPECT_NEAR(PendulumShare(profile, 1e-6, 3.6), 1, 1e-5);
    EXPECT_NEAR(PendulumShare(profile, 0.1, 3.6), std::exp(-3.6 * 0.05), 0.01);  // about its middle
  }
}

// Soles of the robot's file: half their length and width around their centres.
TEST(PushBound, DistanceIsToTheHullOfWhatBears) {
  const logging::RunRecord both = Standing(0.03, 0.02);
  const double length = both.robot.feet()[0].length, width = both.robot.feet()[0].width;
  const auto distance = [&](const std::string& direction, const logging::RunRecord& run) {
    const auto bound = FindPushBound(PushScenario(direction), run);
    return bound && bound->bounded() ? bound->distance : NAN;
  };
  EXPECT_NEAR(distance("direction_x: 1", both), length / 2 - 0.03, 1e-12);
  EXPECT_NEAR(distance("direction_x: -1", both), length / 2 + 0.03, 1e-12);
  EXPECT_NEAR(distance("direction_x: 5", both), length / 2 - 0.03, 1e-12);
  EXPECT_NEAR(distance("direction_y: 1", both), 0.1 + width / 2 - 0.02, 1e-12);
  EXPECT_NEAR(distance("direction_y: -1", both), 0.1 + width / 2 + 0.02, 1e-12);
  EXPECT_NEAR(distance("direction_x: 1 direction_y: 1", both), std::sqrt(2) * (length / 2 - 0.03),
              1e-12);
  const logging::RunRecord right = Standing(0.03, -0.1, true, false);
  EXPECT_NEAR(distance("direction_y: 1", right), width / 2, 1e-12);
  EXPECT_TRUE(std::isnan(distance("direction_y: 1", Standing(0, 0, false, false))));
  // Outside what bears there is no distance to its edge.
  EXPECT_TRUE(std::isnan(distance("direction_y: 1", Standing(0, 0.1, true, false))));
}

// A robot that hops, or whose capture point is outside its soles, is pushed by as much as one that
// stands.
TEST(PushBound, TheImpulseNeedsNoBound) {
  const auto known = FindPushBound(PushScenario("direction_y: 1"), Standing(0, 0));
  for (const auto& run : {Standing(0, 0, false, false), Standing(0, 0.1, true, false)}) {
    const auto push = FindPushBound(PushScenario("direction_y: 1"), run);
    ASSERT_TRUE(push);
    EXPECT_FALSE(push->bounded());
    EXPECT_EQ(push->impulse, known->impulse);
    EXPECT_EQ(push->mass, known->mass);
  }
}

TEST(PushBound, AMovingRobotHasItsCapturePointInstead) {
  logging::RunRecord run = Standing(0, 0);
  ground_truth_t truth = *run.truth.at(5);
  truth.com_velocity[1] = 0.1;
  run.truth.Set(5, truth);
  const auto rest = FindPushBound(PushScenario("direction_y: 1"), Standing(0, 0));
  const auto moving = FindPushBound(PushScenario("direction_y: 1"), run);
  // What it already moves with counts as an impulse given before.
  EXPECT_NEAR(moving->lip_impulse, rest->lip_impulse - rest->mass * 0.1, 1e-9);
}

// The one of two pushes alike towards the nearer edge counts, and none that the run does not have.
TEST(PushBound, OfSeveralTheNearestToItsBoundCounts) {
  const logging::RunRecord run = Standing(0, 0.05);
  Scenario two = PushScenario("direction_y: -1");
  const double away = FindPushBound(two, run)->distance;
  *two.mutable_sim()->add_push() = PushScenario("direction_y: 1").sim().push(0);
  EXPECT_NEAR(FindPushBound(two, run)->distance, away - 0.1, 1e-9);
  EXPECT_NEAR(FindPushBound(two, run)->impulse, 100 * kDuration * 2 / pi, 1e-12);
  two.mutable_sim()->mutable_push(1)->set_start(1);  // the run has 0.012 s
  EXPECT_NEAR(FindPushBound(two, run)->distance, away, 1e-9);
}

// The push begins at tick 1, the foot leaves at 2 and is down at 5.
TEST(PushBound, AStepCatchesWhatComesDuringItAtItsReach) {
  logging::RunRecord run = Standing(0, 0);
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    external_push_t push{};
    push.force[0] = tick == 1 ? 100 : 0;
    run.push.Set(tick, push);
    planner_status_t planner{};
    planner.stepping = tick == 2   ? planner_status_t::STEPPING_UNLOADING
                       : tick == 3 ? planner_status_t::STEPPING_SWINGING
                                   : planner_status_t::STEPPING_NONE;
    if (tick == 4) planner.stepping = planner_status_t::STEPPING_SWINGING;
    run.planner.Set(tick, planner);
  }
  Scenario scenario = PushScenario("direction_x: 1");
  EXPECT_EQ(FindPushBound(scenario, run)->step_time, 0) << "no recovery, no step";
  scenario.mutable_step_planner()->mutable_recovery()->set_enabled(true);
  const auto bound = FindPushBound(scenario, run);
  ASSERT_TRUE(bound);
  EXPECT_NEAR(bound->step_time, 4 * 0.002, 1e-12);
  // A sole in front of the other has its toe at least a sole's length farther.
  EXPECT_GT(bound->reach, run.robot.feet()[0].length);
  const double frequency = std::sqrt(robot::kGravity / 0.75);
  EXPECT_NEAR(
      bound->step_impulse,
      bound->lip_impulse + bound->mass * frequency * bound->reach * std::exp(-frequency * 0.008),
      1e-9);
}

TEST(PushBound, ThereIsNoneForOtherPushes) {
  const logging::RunRecord run = Standing(0, 0);
  EXPECT_FALSE(FindPushBound(Scenario(), run));
  EXPECT_FALSE(FindPushBound(PushScenario("direction_z: 1"), run));
  Scenario hand = PushScenario("direction_y: 1");
  hand.mutable_sim()->add_hand();
  EXPECT_FALSE(FindPushBound(hand, run));
  // An oblique one's horizontal part counts.
  const auto oblique = FindPushBound(PushScenario("direction_x: 3 direction_z: 4"), run);
  EXPECT_NEAR(oblique->impulse, 100 * kDuration * 2 / pi * 0.6, 1e-12);
}

}  // namespace
}  // namespace poise
