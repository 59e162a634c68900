// Walking in a world of its own: a point mass that obeys the pendulum's equations, on feet that go
// where the swing says.
#include "components/step_planner/stepping/walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "components/balance/contact_transition.h"
#include "components/robot/posture.h"
#include "tests/robot/robot_test_support.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

constexpr double kPeriod = 0.002;      // s
constexpr double kSearchDepth = 0.06;  // m
constexpr double kLower = 0.02;        // m

WalkSpec Spec(const Reach& reach, double spacing) {
  WalkSpec spec;
  spec.start = 0.8;
  spec.unload = spec.load = 0.2;
  spec.swing = 0.55;
  spec.settle = 0.05;
  spec.step = {spacing, reach.least_spacing(), 0.25, 0.12, 0.35};
  spec.acceleration = 0.1;
  spec.turn_acceleration = 0.2;
  spec.foot = {0.04, 0.1, 0.1};
  spec.touch_load = 10;
  spec.touch_duration = 0.006;
  spec.search_depth = kSearchDepth;
  spec.gain = 1;
  spec.adjust_from = 0.01;
  spec.lower = kLower;
  spec.height_rate = 6;
  spec.yaw_rate = 5;
  spec.rest_distance = 0.02;
  spec.rest_speed = 0.04;
  spec.rest_time = 0.3;
  return spec;
}

constexpr double kEdge = 0.02;          // m
constexpr double kRollDamping = 0.007;  // m/(rad/s)
constexpr double kSoft = 0.02;          // m
constexpr double kSoftDamping = 0.001;  // m^1.5/(rad/s)
constexpr double kLead = 0.01;          // m
constexpr double kWeight = 500;         // N
constexpr double kDownLoad = 200;       // N of a foot that is down
constexpr double kTouchLoad = 20;       // N of one that touches what does not carry
constexpr double kMostTilt = 0.4;       // rad
constexpr double kPatience = 1;         // s
constexpr double kSinkSpeed = 0.02;     // m/s

class World {
 public:
  /// `rough`: m, by how much the ground is lower under every third foothold.
  /// `patient`: s more for each ramp of the load.
  /// `rests`: the capture point, above the sole that carries.
  /// `places`: of WalkSpec.
  /// `slowest_swing`: of WalkSpec, with soft_damping; 1: neither.
  explicit World(TestRobot robot, double rough = 0, double patient = 0, bool rests = false,
                 int places = 0, double slowest_swing = 1)
      : model_(robot::LoadTestRobot(robot)), rough_(rough) {
    const double height = robot::StandingHeight(model_);
    const Reach reach(model_, height, 0.08 * height, 0.1, 0.02);
    StepLimits limits;
    limits.edge = kEdge;
    limits.spacing = std::max(robot::StandingSpacing(model_), reach.least_spacing());
    WalkSpec spec = Spec(reach, limits.spacing);
    spec.load += patient;
    spec.unload += patient;
    spec.rests = rests;
    spec.off_center = 0.02;
    spec.line = 0.03;
    spec.places = places;
    spec.place_shift = 0.15;
    spec.patience = kPatience;
    spec.most_tilt = kMostTilt;
    spec.roll_damping = kRollDamping;
    spec.lead = kLead;
    spec.press_share = rests ? 0.1 : 0;
    spec.press_load = rests ? kDownLoad : 0;
    spec.weight = kWeight;
    spec.most_sinking = 0.2;
    spec.most_ahead = 0.05;
    spec.sink_speed = kSinkSpeed;
    spec.soft = kSoft;
    spec.slowest_swing = slowest_swing;
    if (slowest_swing > 1) spec.soft_damping = {kSoftDamping, 2 * kSoftDamping};
    walk_ = Walk(StepChoice(model_, reach, limits), spec);
    com_ = {0, 0, height};
    for (size_t i = 0; i < 2; ++i) {
      sole_[i] = Eigen::Translation3d(0, (i == 0 ? -0.5 : 0.5) * limits.spacing, 0) *
                 Eigen::Isometry3d::Identity();
    }
  }

  /// Ground that gives way by so much, m, under a foot that is down.
  void Soften(double depth) { soft_ = depth; }
  /// No ground under a sole whose centre is from `from` to `to`, m, along x.
  void Dig(double from, double to) { hole_ = {from, to}; }
  /// Ground on which a pressed sole there lies tilted by so much, rad.
  void Slant(double from, double to, double tilt) {
    slanted_ = {from, to};
    tilt_ = tilt;
  }
  /// Ground that a sole there touches, and that does not take the press.
  void Weaken(double from, double to) { weak_ = {from, to}; }
  /// The centre of pressure asked for in the next tick if the soles turned like this.
  Vector2d AskedFor(const Vector3d& turning, const WalkCommand& command) const {
    StepInput input = See();
    input.sole_turning = {turning, turning};
    Walk walk = walk_;
    walk.Update(input, command);
    return walk.output().cop;
  }
  bool Lost(const Vector2d& push) const {
    StepInput input = See();
    input.com_velocity.head<2>() += push;
    return walk_.Lost(input);
  }

  /// From the next tick on each tick is a fresh object's, which has but the archive of the last
  /// one.
  void Hand(const Walk& fresh) { fresh_ = fresh; }
  void Push(const Vector2d& velocity) { velocity_.head<2>() += velocity; }

  void Run(double duration, const WalkCommand& command) {
    for (const double end = time_ + duration; time_ < end - 0.5 * kPeriod;) Tick(command);
  }

  /// Another planner has the feet.
  void Recover(double duration) {
    for (const double end = time_ + duration; time_ < end - 0.5 * kPeriod; time_ += kPeriod) {
      walk_.Stop(time_);
    }
  }

  /// False: it has not come to `stage` within 10 s.
  bool RunTo(WalkStage stage, const WalkCommand& command) {
    const double end = time_ + 10;
    while (walk_.stage() != stage && time_ < end) Tick(command);
    return walk_.stage() == stage;
  }

  Walk& walk() { return walk_; }
  const std::array<Eigen::Isometry3d, 2>& sole() const { return sole_; }
  Vector2d middle() const {
    return 0.5 * (sole_[0].translation() + sole_[1].translation()).head<2>();
  }
  double time() const { return time_; }
  double yaw() const { return 0.5 * (Yaw(sole_[0]) + Yaw(sole_[1])); }
  const Vector3d& com() const { return com_; }
  Vector2d capture_point() const {
    return com_.head<2>() + std::sqrt(com_.z() / robot::kGravity) * velocity_.head<2>();
  }
  double largest_jump() const { return largest_jump_; }

 private:
  static bool IsAt(const std::array<double, 2>& range, const Eigen::Isometry3d& sole) {
    return sole.translation().x() > range[0] && sole.translation().x() < range[1];
  }
  double Ground(const Eigen::Isometry3d& sole) const {
    if (IsAt(hole_, sole)) return -1;
    return walk_.num_steps() % 3 == 1 ? -rough_ : 0;
  }

  StepInput See() const {
    StepInput input;
    input.time = time_;
    input.com = com_;
    input.com_velocity = velocity_;
    input.sole = sole_;
    input.com_height = com_.z();
    for (size_t i = 0; i < 2; ++i) {
      const bool down = in_contact_[i] || sole_[i].translation().z() <= Ground(sole_[i]);
      input.load[i] = !down ? 0 : IsAt(weak_, sole_[i]) && !in_contact_[i] ? kTouchLoad : kDownLoad;
    }
    return input;
  }

  void Tick(const WalkCommand& command) {
    const StepInput input = See();
    if (fresh_) TakeOver();
    const bool was_active = walk_.active();
    if (walk_.Update(input, command)) {
      const StepOutput& output = walk_.output();
      in_contact_ = output.in_contact;
      if (was_active) {
        largest_jump_ = std::max(largest_jump_, (output.cop - last_cop_).norm());
      }
      last_cop_ = output.cop;
      Move(output);
    }
    time_ += kPeriod;
  }

  void TakeOver() {
    StateArchive measure;
    walk_.Archive(&measure);
    std::vector<uint8_t> bytes(measure.size());
    StateArchive save = StateArchive::Saving(bytes);
    walk_.Archive(&save);
    walk_ = *fresh_;
    StateArchive restore = StateArchive::Restoring(bytes);
    walk_.Archive(&restore);
    EXPECT_TRUE(save.ok() && restore.ok());
  }

  void Move(const StepOutput& output) {
    balance::ConvexPolygon soles;
    for (size_t i = 0; i < 2; ++i) {
      if (in_contact_[i]) {
        soles = HullOf(
            soles, SoleAt(model_.feet()[i], 0, sole_[i].translation().head<2>(), Yaw(sole_[i])));
        continue;
      }
      sole_[i].translation() = output.swing.position;
      sole_[i].linear() = output.swing_rotation.rotation;
      double& z = sole_[i].translation().z();
      const bool pressed = walk_.stage() == WalkStage::kTouching;
      const double ground = Ground(sole_[i]) - (pressed ? soft_ : 0);
      if (pressed || output.swing.velocity.z() < 0) z = std::max(z, ground);
      if (pressed && soft_ > 0) z = ground;
      if (pressed && IsAt(slanted_, sole_[i])) {
        sole_[i].linear() = Eigen::AngleAxisd(tilt_, Vector3d::UnitX()).toRotationMatrix();
      }
    }
    EXPECT_GE(balance::SignedDistance(soles, output.cop), 0.5 * kEdge) << time_;
    const Vector3d& acceleration = output.com.acceleration;
    for (int i = 0; i < 2; ++i) {
      com_[i] += kPeriod * velocity_[i] + 0.5 * kPeriod * kPeriod * acceleration[i];
      velocity_[i] += kPeriod * acceleration[i];
    }
    com_.z() = output.com.position.z();
    velocity_.z() = output.com.velocity.z();
  }

  robot::RobotModel model_;
  double rough_, soft_ = 0;
  std::array<double, 2> hole_{0, 0}, slanted_{0, 0}, weak_{0, 0};
  double tilt_ = 0;
  Walk walk_;
  std::optional<Walk> fresh_;
  double time_ = 0;
  Vector3d com_, velocity_ = Vector3d::Zero();
  std::array<Eigen::Isometry3d, 2> sole_;
  std::array<bool, 2> in_contact_{true, true};
  Vector2d last_cop_ = Vector2d::Zero();
  double largest_jump_ = 0;
};

const WalkCommand kStand{};

TEST(Walk, StandsUntilItIsTold) {
  World world(TestRobot::kDyros);
  world.Run(1, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(Walk, TenStepsAheadAndAStopSideBySide) {
  World world(TestRobot::kDyros);
  world.Run(11, {{0.1, 0}, 0, true});
  EXPECT_GE(world.walk().num_steps(), 9);
  world.Run(6, kStand);
  EXPECT_FALSE(world.walk().active());
  const Vector3d apart = world.sole()[1].translation() - world.sole()[0].translation();
  EXPECT_NEAR(apart.x(), 0, 0.005);
  EXPECT_GT(apart.y(), 0.15);
  EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02);
  EXPECT_GT(world.middle().x(), 0.8);
  // No jump of the centre of pressure beyond what a tick of the fastest ramp moves it.
  EXPECT_LT(world.largest_jump(), 0.012);
}

// The COM's height begins to move by the time of one tick, however long another planner had the
// feet.
TEST(Walk, BeginsAfterARecoveryAsAfterATick) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.1, 0}, 0, true};
  world.Run(kPeriod, kStand);
  world.Recover(1);
  world.Run(kPeriod, command);
  ASSERT_EQ(world.walk().stage(), WalkStage::kStarting);
  const PointMotion& com = world.walk().output().com;
  EXPECT_LT(com.acceleration.z(), -0.1);
  EXPECT_NEAR(com.velocity.z(), kPeriod * com.acceleration.z(), 1e-9);
}

// Another planner takes over in mid-walk, while the COM is lower than when standing.
TEST(Walk, GoesAsHighAfterARecoveryAsBefore) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.1, 0}, 0, true};
  const double standing = world.com().z();
  world.Run(6, command);
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  const double before = world.com().z();
  EXPECT_NEAR(standing - before, 0.02, 0.002);  // WalkSpec::lower
  world.Recover(0.5);
  world.Run(6, command);
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  EXPECT_NEAR(world.com().z(), before, 0.002);
}

TEST(Walk, KeepsToTheCommandedVelocity) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.15, 0}, 0, true};
  world.Run(6, command);
  const Vector2d from = world.middle();
  world.Run(20, command);
  EXPECT_NEAR((world.middle() - from).x() / 20, 0.15, 0.015);
  EXPECT_NEAR((world.middle() - from).y(), 0, 0.01);
}

TEST(Walk, TurnsAndStepsAside) {
  World world(TestRobot::kDyros);
  world.Run(10, {{0, 0}, 0.1, true});
  world.Run(5, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_GT(world.yaw(), 0.5);
  EXPECT_NEAR(Yaw(world.sole()[0]), Yaw(world.sole()[1]), 0.01);
  EXPECT_NEAR(world.walk().body_yaw().position, world.yaw(), 0.02);
  World aside(TestRobot::kDyros);
  aside.Run(10, {{0, -0.05}, 0, true});
  aside.Run(5, kStand);
  EXPECT_FALSE(aside.walk().active());
  EXPECT_LT(aside.middle().y(), -0.25);
}

TEST(Walk, APushIsCaughtByTheNextFoothold) {
  // More than the centre of pressure within the sole brings back, on the side of the foot in the
  // air.
  for (const Vector2d& push : {Vector2d(0.25, 0), Vector2d(-0.25, 0), Vector2d(0, 0.12)}) {
    World world(TestRobot::kDyros);
    const WalkCommand command{{0, 0}, 0, true};
    world.Run(3, command);
    while (world.walk().stage() != WalkStage::kSwinging || world.walk().stepping_foot() != 1) {
      world.Run(kPeriod, command);
    }
    world.Run(0.1, command);
    world.Push(push);
    world.Run(8, command);
    world.Run(6, kStand);
    EXPECT_FALSE(world.walk().active()) << push.transpose();
    EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02) << push.transpose();
  }
}

TEST(Walk, GoesOnWhereTheGroundIsLower) {
  // With time to take the load over, the capture point stays above the sole that carries: the other
  // foot may come down late.
  for (const auto& [rough, patient] : {std::pair(0.005, 0.0), std::pair(0.04, 0.5)}) {
    World world(TestRobot::kDyros, rough, patient);
    world.Run(30, {{0.05, 0}, 0, true});
    EXPECT_GE(world.walk().num_steps(), 12);
    world.Run(10, kStand);
    EXPECT_FALSE(world.walk().active());
  }
}

TEST(Walk, RestsAboveTheSoleThatCarriesHoweverLateTheOtherComesDown) {
  // The ground is 55 mm lower under every third foothold: half a second late at 0.1 m/s.
  World world(TestRobot::kDyros, 0.055, 0.5, true);
  const WalkCommand command{{0.05, 0}, 0, true};
  bool rested = false;
  for (int i = 0; i < 20000; ++i) {
    world.Run(kPeriod, command);
    const Walk& walk = world.walk();
    if (walk.stage() != WalkStage::kTouching) continue;
    const auto stance = static_cast<size_t>(1 - walk.stepping_foot());
    const Vector2d off = world.capture_point() - world.sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
    rested = true;
  }
  EXPECT_TRUE(rested);
  EXPECT_GE(world.walk().num_steps(), 12);
  world.Run(15, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(Walk, LoadLeavesAFootNoSoonerThanTheCentreOfPressure) {
  World world(TestRobot::kDyros, 0, 0.5, true);
  const WalkCommand command{{0.05, 0}, 0, true};
  double most = 0;
  int seen = 0;
  for (int i = 0; i < 10000; ++i) {
    world.Run(kPeriod, command);
    const Walk& walk = world.walk();
    if (walk.stage() != WalkStage::kUnloading || walk.num_steps() == 0) continue;
    const auto leaves = static_cast<size_t>(walk.stepping_foot());
    const Vector2d other = world.sole()[1 - leaves].translation().head<2>();
    const Vector2d way = world.sole()[leaves].translation().head<2>() - other;
    // As much as lies below the centre of pressure, were each sole's own in its middle.
    const double natural = (walk.output().cop - other).dot(way) / way.squaredNorm();
    const double left = std::max(natural, 0.0);
    const double carries = left * (1 - balance::SmoothStep(walk.output().progress));
    most = std::max(most, (left - carries) * way.norm());
    ++seen;
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(most, 0.5 * kLead);  // the ramp runs at all
  EXPECT_LT(most, 1.3 * kLead);  // a tick late, and the slowest rate
}

TEST(Walk, StandsInTheMiddlesOfBothSolesWhilePressing) {
  World world(TestRobot::kDyros, 0, 0.5, true);
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
  // The stance keeps nine tenths of the weight, the other sole takes one.
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  world.Run(0.1, command);
  const auto landed = static_cast<size_t>(1 - world.walk().stepping_foot());
  const Vector2d stance = world.sole()[1 - landed].translation().head<2>();
  const Vector2d way = world.sole()[landed].translation().head<2>() - stance;
  const double share = (world.walk().wanted().capture_point - stance).dot(way) / way.squaredNorm();
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.1);
}

TEST(Walk, GoesDownAndWaitsAsThePressLetsExpect) {
  for (const double depth : {0.0, 0.04}) {
    World world(TestRobot::kDyros, 0, 0.5, true);
    const WalkCommand command{{0, 0}, 0, true};
    world.Soften(depth);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    const double start = world.time(), height = world.com().z();
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    // A spring that 200 of 500 N press by `depth` goes down by 2.5 times that under all of them.
    const double whole = depth * kWeight / kDownLoad;
    EXPECT_GE(world.time() - start, std::max(whole / kSinkSpeed, 1.4) - 0.01) << depth;
    EXPECT_LT(world.time() - start, std::max(whole / kSinkSpeed, 1.4) + 1.0) << depth;
    // The foot stands `depth` lower; three fifths of the load are still to come, of which
    // most_ahead counts. Above a sole that sinks the COM comes up by `lower`, as its leg reaches.
    const double ahead = std::min(0.6 * whole, 0.05), up = whole > kSoft ? kLower : 0;
    EXPECT_NEAR(height - world.com().z(), depth + ahead - up, 0.005) << depth;
  }
}

// Where a sole has sunk the other foot looks for the ground where that sole met it, and as deep
// below where it stands as else.
TEST(Walk, LooksForTheGroundWhereTheSunkSoleMetIt) {
  const WalkCommand command{{0.05, 0}, 0, true};
  constexpr double kSunk = 0.05;
  for (const bool hole : {false, true}) {
    World world(TestRobot::kDyros, 0, 0.5, true);
    world.Soften(kSunk);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    const double due = world.walk().touch_down();
    if (hole) world.Dig(-1, 1);
    if (!hole) {
      ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
      EXPECT_NEAR(world.time(), due, 0.02);
    } else {
      world.Run(3, command);
      EXPECT_NEAR(world.walk().output().swing.position.z(), -kSunk - kSearchDepth, 1e-3);
    }
  }
}

/// Until the second foot has come down, the capture point above the sole that carries meanwhile.
void WalkOverAHole(World* world, const WalkCommand& command) {
  for (int i = 0; i < 15000 && world->walk().num_steps() < 2; ++i) {
    world->Run(kPeriod, command);
    if (!world->walk().retreating()) continue;
    const auto stance = static_cast<size_t>(1 - world->walk().stepping_foot());
    const Vector2d off = world->capture_point() - world->sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
  }
}

TEST(Walk, LeavesAPlaceWithoutGroundForAnother) {
  // The first step is to x = 0.06 m or so: nothing is there, nor 0.15 m farther ahead.
  World world(TestRobot::kDyros, 0, 0.5, true, 4);
  world.Dig(0.02, 0.3);
  const WalkCommand command{{0.05, 0}, 0, true};
  WalkOverAHole(&world, command);
  EXPECT_GE(world.walk().num_left(), 2);
  ASSERT_EQ(world.walk().num_steps(), 2);
  for (const Eigen::Isometry3d& sole : world.sole()) {
    const double x = sole.translation().x();
    EXPECT_TRUE(x <= 0.02 || x >= 0.3) << x;
    EXPECT_NEAR(sole.translation().z(), 0, 0.002);
  }
}

TEST(Walk, LeavesAPlaceWhereItsSoleLiesTooTilted) {
  for (const double tilt : {0.9 * kMostTilt, -0.9 * kMostTilt, 1.1 * kMostTilt, -1.1 * kMostTilt}) {
    World world(TestRobot::kDyros, 0, 0.5, true, 4);
    world.Slant(0.02, 0.3, tilt);
    WalkOverAHole(&world, {{0.05, 0}, 0, true});
    ASSERT_EQ(world.walk().num_steps(), 2) << tilt;
    EXPECT_EQ(world.walk().num_left() > 0, std::abs(tilt) > kMostTilt) << tilt;
  }
}

TEST(Walk, LeavesAPlaceThatDoesNotTakeThePressForLong) {
  World world(TestRobot::kDyros, 0, 0.5, true, 4);
  world.Weaken(0.02, 0.3);
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
  const double touched = world.time();
  while (world.walk().num_left() == 0 && world.time() < touched + 5) world.Run(kPeriod, command);
  EXPECT_NEAR(world.time() - touched, kPatience, 0.05);
}

TEST(Walk, AFootThatFindsNoPlaceComesBackToWhereItStood) {
  World world(TestRobot::kDyros, 0, 0.5, true, 2);
  const WalkCommand command{{0.05, 0}, 0, true};
  while (world.walk().stage() != WalkStage::kSwinging) world.Run(kPeriod, command);
  const auto foot = static_cast<size_t>(world.walk().stepping_foot());
  const Vector3d home = world.sole()[foot].translation();
  // All but where it stands: ahead now, and behind once that was left.
  world.Dig(home.x() + 0.02, 1);
  while (world.walk().num_left() < 2) world.Run(kPeriod, command);
  world.Dig(-1, home.x() - 0.02);
  for (int i = 0; i < 5000 && world.walk().num_steps() == 0; ++i) world.Run(kPeriod, command);
  EXPECT_EQ(world.walk().num_left(), 3);
  ASSERT_EQ(world.walk().num_steps(), 1);
  EXPECT_LT((world.sole()[foot].translation() - home).norm(), 0.005);
}

TEST(Walk, TheArchiveIsAllOfItsState) {
  // A turn, holes and a stop; then a push while it does not rest.
  for (const bool rests : {true, false}) {
    std::vector<World> worlds(2, World(TestRobot::kDyros, 0, rests ? 0.5 : 0, rests, 4));
    worlds[1].Hand(worlds[1].walk());
    for (int tick = 0; tick < 12000; ++tick) {
      for (World& world : worlds) {
        if (tick == 0 && rests) world.Dig(0.02, 0.2);
        if (tick == 2000 && !rests) world.Push({0.1, 0.02});
        world.Run(kPeriod, tick < 8000 ? WalkCommand{{0.05, 0}, 0.05, true} : kStand);
      }
      for (size_t foot = 0; foot < 2; ++foot) {
        ASSERT_EQ(worlds[0].sole()[foot].matrix(), worlds[1].sole()[foot].matrix()) << tick;
      }
      ASSERT_EQ(worlds[0].com(), worlds[1].com()) << tick;
      ASSERT_EQ(worlds[0].walk().output().cop, worlds[1].walk().output().cop) << tick;
      ASSERT_EQ(worlds[0].walk().num_left(), worlds[1].walk().num_left()) << tick;
    }
    EXPECT_EQ(worlds[0].walk().num_left() > 0, rests);
    EXPECT_GE(worlds[0].walk().num_steps(), 4);
  }
}

TEST(Walk, WithoutOtherPlacesAFootWaitsWhereItIs) {
  World world(TestRobot::kDyros, 0, 0.5, true, 0);
  world.Dig(0.02, 1);
  WalkOverAHole(&world, {{0.05, 0}, 0, true});
  EXPECT_EQ(world.walk().num_left(), 0);
  EXPECT_EQ(world.walk().num_steps(), 0);
}

TEST(Walk, BrakesASoleThatTurns) {
  World world(TestRobot::kDyros, 0, 0.5, true);
  const WalkCommand command{{0, 0}, 0, true};
  while (world.walk().stage() != WalkStage::kSwinging) world.Run(kPeriod, command);
  world.Run(0.2, command);
  const Vector2d still = world.AskedFor(Vector3d::Zero(), command);
  for (const Vector3d& turning :
       {Vector3d(0.5, 0, 0), Vector3d(0, -0.8, 0), Vector3d(0.4, 0.3, 2)}) {
    const Vector2d moved = world.AskedFor(turning, command) - still;
    // The ankle turns the sole as the ground's force at the centre of pressure turns it back: of
    // a unit weight that force's moment is this, and the ankle's the opposite.
    const Vector3d ground = Vector3d(moved.x(), moved.y(), 0).cross(Vector3d::UnitZ());
    const Vector3d about = Vector3d(turning.x(), turning.y(), 0);
    EXPECT_LT((-ground + kRollDamping * about).norm(), 1e-9) << turning.transpose();
    EXPECT_LT(-ground.dot(turning), 0);
  }
}

// Soles that sink by 2.5 and 4.5 times what counts as soft: the swing takes the root of it longer,
// at most twice, and the turning of the sole is braked by the root of the ground's stiffness.
TEST(Walk, SwingsSlowlyAboveASoleThatHasSunkAndBrakesItsTurning) {
  const WalkCommand command{{0, 0}, 0, true};
  for (const double sinks : {0.0, 2.5 * kSoft, 4.5 * kSoft}) {
    World world(TestRobot::kDyros, 0, 0.5, true, 0, 2);
    ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
    world.Soften(sinks * kDownLoad / kWeight);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    const double due = world.walk().touch_down() - world.time();
    EXPECT_NEAR(due / 0.55, std::clamp(std::sqrt(sinks / kSoft), 1.0, 2.0), 0.02) << sinks;
    world.Run(0.2, command);
    const Vector2d still = world.AskedFor(Vector3d::Zero(), command);
    const double soft = sinks > 0 ? 1 / std::sqrt(sinks) : 0;
    for (const Vector3d& turning : {Vector3d(0.1, 0, 0), Vector3d(0, -0.1, 0)}) {
      const Vector2d moved = world.AskedFor(turning, command) - still;
      const Vector2d expected(-(kRollDamping + 2 * kSoftDamping * soft) * turning.y(),
                              (kRollDamping + kSoftDamping * soft) * turning.x());
      EXPECT_LT((moved - expected).norm(), 1e-9) << sinks;
    }
  }
}

TEST(Walk, IsLostOnceTheCapturePointHasLeftTheSoleThatCarries) {
  World world(TestRobot::kDyros, 0, 0.5, true);
  const WalkCommand command{{0, 0}, 0, true};
  EXPECT_FALSE(world.Lost({1, 0}));  // it stands
  while (world.walk().stage() != WalkStage::kSwinging) world.Run(kPeriod, command);
  world.Run(0.2, command);
  // The sole is 0.3 m long and 0.15 m wide; a velocity v moves the capture point by v sqrt(z/g).
  const double time = std::sqrt(world.com().z() / robot::kGravity);
  EXPECT_FALSE(world.Lost({0, 0}));
  EXPECT_FALSE(world.Lost({0.12 / time, 0}));
  EXPECT_TRUE(world.Lost({0.18 / time, 0}));
  EXPECT_FALSE(world.Lost({0, 0.05 / time}));
  EXPECT_TRUE(world.Lost({0, 0.1 / time}));
}

}  // namespace
}  // namespace poise::stepping
