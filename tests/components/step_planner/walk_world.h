// A world of its own to walk in: a point mass that obeys the pendulum's equations, on feet that go
// where the swing says.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "components/robot/posture.h"
#include "components/step_planner/stepping/quasi_static_walk.h"
#include "components/step_planner/walk_config.h"
#include "tests/robot/robot_test_support.h"

namespace poise::stepping {
using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

inline const WalkCommand kStand{};
inline constexpr double kPeriod = 0.002;  // s

// What the world has in place of the paper's robot and the ground.
inline constexpr double kWeight = 500;    // N
inline constexpr double kDownLoad = 200;  // N of a foot that is down

class World {
 public:
  /// The quasi-static walk as it ships. `rough`: m, by how much the ground is lower under every
  /// third foothold.
  explicit World(TestRobot robot, double rough = 0)
      : model_(robot::LoadTestRobot(robot)), rough_(rough) {
    const double height = robot::StandingHeight(model_);
    const StepChoice choice = MakeWalkChoice(WalkConfig(), model_);
    spec_ = MakeQuasiStaticSpec(WalkConfig(), ContactConfirmation(), model_, choice);
    spec_.weight = kWeight;
    spec_.landing.press_load = kDownLoad;
    walk_ = QuasiStaticWalk(choice, spec_);
    const StepLimits& limits = choice.limits();
    sole_margin_ = limits.sole_margin;
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
  bool Lost(const Vector2d& push) const {
    StepInput input = See();
    input.com_velocity.head<2>() += push;
    return walk_.Lost(input);
  }

  /// From the next tick on each tick is a fresh object's, which has but the archive of the last
  /// one.
  void Hand(const QuasiStaticWalk& fresh) { fresh_ = fresh; }
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
  bool RunTo(Stage stage, const WalkCommand& command) {
    const double end = time_ + 10;
    while (walk_.stage() != stage && time_ < end) Tick(command);
    return walk_.stage() == stage;
  }

  QuasiStaticWalk& walk() { return walk_; }
  const QuasiStaticSpec& spec() const { return spec_; }
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
    return walk_.num_landed() % 3 == 1 ? -rough_ : 0;
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
      input.load[i] = down ? kDownLoad : 0;
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
      const bool pressed = walk_.stage() == Stage::kTouching;
      const double ground = Ground(sole_[i]) - (pressed ? soft_ : 0);
      if (pressed || output.swing.velocity.z() < 0) z = std::max(z, ground);
      if (pressed && soft_ > 0) z = ground;
    }
    EXPECT_GE(balance::SignedDistance(soles, output.cop), 0.5 * sole_margin_) << time_;
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
  std::array<double, 2> hole_{0, 0};
  double sole_margin_ = 0;
  QuasiStaticSpec spec_;
  QuasiStaticWalk walk_;
  std::optional<QuasiStaticWalk> fresh_;
  double time_ = 0;
  Vector3d com_, velocity_ = Vector3d::Zero();
  std::array<Eigen::Isometry3d, 2> sole_;
  std::array<bool, 2> in_contact_{true, true};
  Vector2d last_cop_ = Vector2d::Zero();
  double largest_jump_ = 0;
};

}  // namespace poise::stepping
