// The component: what it publishes when, in which units, frames and signs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "components/framework/operator_acts.h"
#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

// A component wired by hand: binds the command of the tick before and runs the stage, as a runner
// would.
class Bench {
 public:
  explicit Bench(const SimConfig& config, uint64_t seed = 1) {
    resources_["robot"] = ReadFile(RobotFolder() + "dyros_legs.pbtxt");
    resources_["urdf"] = ReadFile(RobotFolder() + "dyros_legs.urdf");
    ComponentContext context;
    context.name = "sim";
    context.config_text = "sim { robot_drive_train: false " + config.DebugString() + " }";
    context.tick_period = kTick;
    context.seed = seed;
    context.resources = &resources_;
    context.shared = &shared_;
    component_->Configure(context, &wiring_);
  }

  void Run(const drive_command_t* command) {
    wiring_.inputs().at(0)->Bind(command);
    wiring_.inputs().at(1)->Bind(nullptr);  // no bridge
    const Stage& stage = wiring_.stages().at(0);
    const double time = static_cast<double>(tick_) * kTick;
    const Tick tick{tick_, std::llround(time * 1e6), time};
    for (OutputPort* output : stage.outputs) output->Stamp(77, tick.index, tick.utime);
    stage.run(tick);
    for (const OutputPort* output : stage.outputs) EXPECT_TRUE(output->Finite());
    ++tick_;
  }

  template <class T>
  const T& Get(const std::string& name) const {
    for (const OutputPort* output : wiring_.outputs()) {
      if (output->name() == name) return *static_cast<const T*>(output->message());
    }
    throw std::out_of_range(name);
  }
  const drive_feedback_t& feedback() const { return Get<drive_feedback_t>("drive_feedback"); }
  const ground_truth_t& truth() const { return Get<ground_truth_t>("ground_truth"); }
  const external_push_t& push() const { return Get<external_push_t>("external_push"); }
  const Wiring& wiring() const { return wiring_; }
  ActInput& acts() { return *dynamic_cast<ActInput*>(wiring_.inputs().at(2)); }
  const Component& component() const { return *component_; }

 private:
  std::map<std::string, std::string> resources_;
  SharedObjects shared_;
  std::unique_ptr<Component> component_ = EngineType().make();
  Wiring wiring_;
  int64_t tick_ = 0;
};

drive_command_t Command(double current) {
  drive_command_t command;
  command.num_motors = 12;
  command.current.assign(12, current);
  command.enabled.assign(12, 1);
  command.position.assign(12, 0);
  command.velocity.assign(12, 0);
  command.stiffness.assign(12, 0);
  command.damping.assign(12, 0);
  return command;
}

TEST(SimComponent, DeclaresItsPorts) {
  const Bench bench(StandingConfig());
  const Wiring& wiring = bench.wiring();
  ASSERT_EQ(wiring.inputs().size(), 3u);
  EXPECT_EQ(wiring.inputs()[0]->name(), "drive_command");
  EXPECT_EQ(wiring.inputs()[0]->kind(), InputKind::kPreviousTick);
  EXPECT_THAT(wiring.inputs()[0]->counts(), ::testing::ElementsAre(12));
  EXPECT_EQ(wiring.inputs()[1]->name(), "bridge_status");
  EXPECT_EQ(wiring.inputs()[1]->kind(), InputKind::kPreviousTick);
  EXPECT_EQ(wiring.inputs()[2]->name(), "operator");
  EXPECT_EQ(wiring.inputs()[2]->kind(), InputKind::kLatest);
  ASSERT_EQ(wiring.stages().size(), 1u);
  EXPECT_EQ(wiring.stages()[0].outputs.size(), 3u);
  EXPECT_EQ(bench.feedback().position_counts.size(), 12u);
  EXPECT_EQ(bench.truth().foot_wrench.size(), 2u);
}

TEST(SimComponent, TickZeroReportsTheStartAtRest) {
  Bench bench(StandingConfig("sensor_noise: false"));
  bench.Run(nullptr);
  const ground_truth_t& truth = bench.truth();
  const drive_feedback_t& feedback = bench.feedback();
  EXPECT_EQ(truth.run_id, 77);
  const double weight = PaperRobot().total_mass() * robot::kGravity;
  EXPECT_NEAR(feedback.foot_wrench[0].force[2] + feedback.foot_wrench[1].force[2], weight, 1e-8);
  EXPECT_NEAR(feedback.imu_acceleration[2], robot::kGravity, 1e-9);
  for (int j = 0; j < 12; ++j) {
    const auto i = static_cast<size_t>(j);
    EXPECT_EQ(truth.joint_velocity[i], 0);
    EXPECT_EQ(feedback.velocity[i], 0);
    EXPECT_EQ(feedback.position_counts[i],
              std::llround(truth.joint_position[i] * 50 * 8192 / (2 * std::numbers::pi)));
    EXPECT_EQ(feedback.drive_status[i], drive_feedback_t::DRIVE_ENABLED);
    EXPECT_EQ(feedback.current[i], 0);
  }
  EXPECT_EQ(truth.foot_contact_points[0], 4);
  EXPECT_NEAR(truth.foot_pose[0].position[1] + truth.foot_pose[1].position[1], 0, 1e-9);
  EXPECT_LT(truth.foot_pose[0].position[1], 0) << "right first";
}

TEST(SimComponent, AppliesTheCommandOfTheTickBefore) {
  Bench bench(StandingConfig("sensor_noise: false"));
  bench.Run(nullptr);
  drive_command_t command = Command(1.5);
  command.enabled[4] = 0;
  bench.Run(&command);
  EXPECT_EQ(bench.feedback().current[3], 1.5);
  EXPECT_EQ(bench.feedback().current[4], 0);
  EXPECT_NEAR(bench.truth().joint_torque[3], 1.5 * 50 * 0.10, 1e-12) << "(54)";
  EXPECT_NE(bench.truth().joint_velocity[3], 0);
  EXPECT_EQ(bench.feedback().velocity, bench.truth().joint_velocity);
  bench.Run(nullptr);
  EXPECT_EQ(bench.feedback().current[3], 0) << "no command: motors free";
}

// Each command is another, so that the current tells which one the drives have: the new one, or the
// last one that reached them. How many are lost is binomial.
TEST(SimComponent, ALostCommandLeavesTheLastOne) {
  constexpr int kTicks = 200;
  constexpr double kLoss = 0.3;
  const auto lost = [](uint64_t seed) {
    Bench bench(StandingConfig("sensor_noise: false command_loss: 0.3"), seed);
    std::vector<int> ticks;
    double held = 0;
    for (int i = 0; i < kTicks; ++i) {
      const double current = 0.01 * i;
      const drive_command_t command = Command(current);
      bench.Run(i == 0 ? nullptr : &command);
      const double seen = bench.feedback().current[3];
      if (i > 0 && seen != current) {
        EXPECT_EQ(seen, held) << i;
        ticks.push_back(i);
      }
      held = seen;
    }
    return ticks;
  };
  const std::vector<int> first = lost(1);
  const double deviation = std::sqrt(kTicks * kLoss * (1 - kLoss));
  EXPECT_NEAR(static_cast<double>(first.size()), kTicks * kLoss, 4 * deviation);
  EXPECT_EQ(lost(1), first);
  EXPECT_NE(lost(2), first);
}

TEST(SimComponent, SensorReportsTheReactionOfTheTrueWrench) {
  Bench bench(StandingConfig("sensor_noise: false"));
  for (int i = 0; i < 5; ++i) {
    const drive_command_t command = Command(0);
    bench.Run(i == 0 ? nullptr : &command);
    for (size_t f = 0; f < 2; ++f) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(bench.feedback().foot_wrench[f].force[k], -bench.truth().foot_wrench[f].force[k]);
        EXPECT_EQ(bench.feedback().foot_wrench[f].moment[k],
                  -bench.truth().foot_wrench[f].moment[k]);
      }
      EXPECT_LT(bench.truth().foot_wrench[f].force[2], 0) << "robot on environment presses down";
    }
  }
}

operate::act_t Push(int64_t id, int64_t tick, double force, int64_t duration) {
  operate::act_t act{};
  act.id = id;
  act.tick = tick;
  act.kind = operate::act_t::KIND_PUSH;
  act.force[1] = force;
  act.point[2] = 0.25;
  act.duration = duration;
  return act;
}

TEST(SimComponent, AnOperatorsPushIsThatOfAScenario) {
  // A cycle's force acts from the tick before on: rectangles of the same impulse, motors free.
  Bench scenario(StandingConfig(
      "push { start: 0.018 duration: 0.02 peak: 50 direction_y: 1 profile: RECTANGLE "
      "point { z: 0.25 } }"));
  Bench person(StandingConfig());
  person.acts().SetAddress(0);
  person.acts().Offer(Push(1, 10, 50, 10));
  for (int i = 0; i < 40; ++i) {
    const drive_command_t command = Command(0);
    for (Bench* bench : {&scenario, &person}) bench->Run(i == 0 ? nullptr : &command);
    EXPECT_NEAR(person.truth().push_force[1], i >= 10 && i < 20 ? 50 : 0, 1e-9) << i;
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(person.truth().base_position[k], scenario.truth().base_position[k], 1e-9) << i;
    }
  }
}

TEST(SimComponent, RefusesAPushThatCannotBe) {
  using operate::answer_t;
  Bench bench(StandingConfig());
  bench.acts().SetAddress(0);
  std::vector<operate::act_t> acts(6, Push(0, 2, 50, 10));
  acts[0].body = -1;
  acts[1].body = 1000;
  acts[2].force[0] = 1e300;
  acts[3].point[0] = -1e6;
  acts[4].duration = INT64_MAX;
  acts[5].kind = 99;
  for (size_t i = 0; i < acts.size(); ++i) {
    acts[i].id = static_cast<int64_t>(i) + 1;
    bench.acts().Offer(acts[i]);
  }
  for (int i = 0; i < 5; ++i) {
    bench.Run(nullptr);
    EXPECT_EQ(bench.truth().push_force[1], 0);
  }
  answer_t answer;
  int refused = 0;
  while (bench.acts().TakeAnswer(&answer)) {
    const bool range = answer.id >= 3 && answer.id <= 5;
    EXPECT_EQ(answer.verdict, range ? answer_t::VERDICT_RANGE : answer_t::VERDICT_UNKNOWN);
    ++refused;
  }
  EXPECT_EQ(refused, 6);
}

TEST(SimComponent, PushIsMeasuredWithNoise) {
  Bench bench(StandingConfig(
      "push { start: 0.01 duration: 0.1 peak: 100 direction_y: 1 point { z: 0.25 } }"));
  double worst = 0;
  for (int i = 0; i < 40; ++i) {
    const drive_command_t command = Command(0);
    bench.Run(i == 0 ? nullptr : &command);
    const double time = i * kTick;
    const double expected =
        time < 0.01 ? 0 : 100 * std::sin(std::numbers::pi * (time - 0.01) / 0.1);
    EXPECT_NEAR(bench.truth().push_force[1], expected, 1e-9);
    worst = std::max(worst, std::abs(bench.push().force[1] - expected));
  }
  EXPECT_GT(worst, 0.1);
  EXPECT_LT(worst, 1.0) << "five times 0.2 N";
  EXPECT_NEAR(bench.push().point[2] - bench.truth().base_position[2], 0.25, 0.02);
}

TEST(SimComponent, AFallFailsTheRun) {
  Bench bench(StandingConfig());
  const drive_command_t command = Command(0);
  EXPECT_TRUE(bench.component().finished().empty());
  for (int i = 0; i < 1500; ++i) bench.Run(i == 0 ? nullptr : &command);
  EXPECT_TRUE(bench.component().failed());
  EXPECT_THAT(std::string(bench.component().finished()),
              ::testing::StartsWith("the robot fell at "));
  EXPECT_EQ(bench.truth().fallen, 1);
}

TEST(SimComponent, RefusesBadConfigurations) {
  for (const char* const problem :
       {"step: 0.003", "push_sensor_noise: -1", "command_loss: 1", "command_loss: nan"}) {
    try {
      Bench bench(StandingConfig(problem));
      FAIL() << problem;
    } catch (const ConfigError& error) {
      EXPECT_EQ(error.field(),
                "sim." + std::string(problem).substr(0, std::string(problem).find(':')));
    }
  }
}

}  // namespace
}  // namespace poise
