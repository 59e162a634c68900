// The component with its neighbours faked: messages in, messages out, configuration refused by
// field.
#include "hw_bridge/hw_bridge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>

namespace poise {
namespace {

using testing::HasSubstr;

constexpr int kMotors = 12;
constexpr int64_t kRunId = 5;

std::string ReadDeployed(const std::string& name) {
  std::ifstream file(POISE_SOURCE_DIR "/deploy/robots/dyros/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

class Bridge {
 public:
  explicit Bridge(const std::string& config = "",
                  const std::string& robot = ReadDeployed("dyros_legs.pbtxt")) {
    resources_ = {{"robot", robot}, {"urdf", ReadDeployed("dyros_legs.urdf")}};
    ComponentContext context;
    context.name = "hw_bridge";
    context.config_text = config;
    context.tick_period = 0.002;
    context.resources = &resources_;
    context.shared = &shared_;
    bridge_.Configure(context, &wiring_);
    MessageTraits<drive_feedback_t>::Resize(feedback, MessageCounts{kMotors, 2});
    feedback.run_id = kRunId;
    feedback.drive_status.assign(kMotors, drive_feedback_t::DRIVE_ENABLED);
    MessageTraits<joint_command_t>::Resize(command, MessageCounts{kMotors, 2});
    command.run_id = kRunId;
    stop.run_id = kRunId;
    stop.stop = 1;
  }

  /// One cycle. `with_command`: the command of this cycle arrives; `with_stop`: an emergency_stop_t
  /// is there.
  void Step(bool with_command = true, bool with_stop = false) {
    feedback.tick = command.tick = tick_;
    Find("drive_feedback")->Bind(&feedback);
    Find("joint_command")->Bind(with_command ? &command : nullptr);
    Find("emergency_stop")->Bind(with_stop ? &stop : nullptr);
    const Tick tick{tick_, 2000 * tick_, 0.002 * static_cast<double>(tick_)};
    for (const Stage& stage : wiring_.stages()) {
      for (OutputPort* output : stage.outputs) output->Stamp(kRunId, tick.index, tick.utime);
      stage.run(tick);
    }
    ++tick_;
  }

  template <class T>
  const T& Output(const std::string& name) const {
    for (OutputPort* output : wiring_.outputs()) {
      if (output->name() == name) return *static_cast<const T*>(output->message());
    }
    throw std::logic_error("no output " + name);
  }
  const robot_sensors_t& sensors() const { return Output<robot_sensors_t>("robot_sensors"); }
  const drive_command_t& drives() const { return Output<drive_command_t>("drive_command"); }
  const bridge_status_t& status() const { return Output<bridge_status_t>("bridge_status"); }
  const Wiring& wiring() const { return wiring_; }

  drive_feedback_t feedback;
  joint_command_t command;
  emergency_stop_t stop;

 private:
  InputPort* Find(const std::string& name) const {
    for (InputPort* input : wiring_.inputs()) {
      if (input->name() == name) return input;
    }
    throw std::logic_error("no input " + name);
  }

  std::map<std::string, std::string> resources_;
  SharedObjects shared_;
  HwBridge bridge_;
  Wiring wiring_;
  int64_t tick_ = 0;
};

TEST(HwBridge, SensesInSiUnitsAndAsRobotOnEnvironment) {
  Bridge bridge;
  bridge.feedback.position_counts[3] = 50 * 8192 / 4;  // a quarter turn of the joint
  bridge.feedback.position_counts[4] = -50 * 8192 / 8;
  bridge.feedback.current[2] = -15;  // rated: 75 N·m
  bridge.feedback.velocity[3] = -0.7;
  bridge.feedback.imu_orientation[0] = 0.6;
  bridge.feedback.imu_orientation[3] = -0.8;
  for (int i = 0; i < 3; ++i) {
    bridge.feedback.imu_angular_velocity[i] = 0.1 + i;
    bridge.feedback.imu_acceleration[i] = 9 + i;
    bridge.feedback.foot_wrench[0].force[i] = 100 + i;
    bridge.feedback.foot_wrench[1].moment[i] = -3 - i;
  }
  bridge.Step();
  const robot_sensors_t& sensors = bridge.sensors();
  EXPECT_NEAR(sensors.joint_position[3], std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(sensors.joint_position[4], -std::numbers::pi / 4, 1e-12);
  EXPECT_DOUBLE_EQ(sensors.joint_torque[2], -75);
  EXPECT_EQ(sensors.joint_velocity[3], -0.7);
  EXPECT_THAT(sensors.imu_orientation,
              ::testing::Pointwise(::testing::DoubleEq(), {0.6, 0.0, 0.0, -0.8}));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(sensors.imu_angular_velocity[i], 0.1 + i);
    EXPECT_EQ(sensors.imu_acceleration[i], 9 + i);
    EXPECT_EQ(sensors.foot_wrench[0].force[i], -100 - i);
    EXPECT_EQ(sensors.foot_wrench[1].moment[i], 3 + i);
    EXPECT_EQ(sensors.foot_wrench[1].force[i], 0);
  }
}

// Poise stands without it: the estimator finds its own.
TEST(HwBridge, AnOrientationOfTheImuThatIsNoneIsZeroAndStopsNothing) {
  Bridge bridge;
  for (const double w : {std::numeric_limits<double>::quiet_NaN(), 0.0, 3.0}) {
    bridge.feedback.imu_orientation[0] = w;
    bridge.Step();
    EXPECT_THAT(bridge.sensors().imu_orientation, ::testing::Each(0.0)) << w;
    EXPECT_EQ(bridge.status().reason, bridge_status_t::REASON_NONE) << w;
  }
}

// The robot stands without them: the estimator observes the wrenches.
TEST(HwBridge, AFootSensorThatReadsNoNumberIsInvalidAndStopsNothing) {
  Bridge bridge;
  bridge.feedback.foot_wrench[0].force[2] = std::numeric_limits<double>::quiet_NaN();
  bridge.feedback.foot_wrench[1].force[2] = 270;
  bridge.Step();
  const robot_sensors_t& sensors = bridge.sensors();
  EXPECT_EQ(sensors.foot_sensor[0], drive_feedback_t::SENSOR_INVALID);
  EXPECT_EQ(sensors.foot_wrench[0].force[2], 0);
  EXPECT_EQ(sensors.foot_sensor[1], drive_feedback_t::SENSOR_OK);
  EXPECT_EQ(sensors.foot_wrench[1].force[2], -270);
  bridge.feedback.foot_wrench[0].force[2] = 270;
  bridge.feedback.foot_sensor[1] = drive_feedback_t::SENSOR_ABSENT;
  bridge.Step();
  EXPECT_EQ(bridge.sensors().foot_sensor[0], drive_feedback_t::SENSOR_OK);
  EXPECT_EQ(bridge.sensors().foot_sensor[1], drive_feedback_t::SENSOR_ABSENT);
  EXPECT_EQ(bridge.sensors().foot_wrench[1].force[2], 0);
}

TEST(HwBridge, TurnsTorqueIntoCurrent) {
  Bridge bridge;
  bridge.command.torque[0] = 10;
  bridge.command.torque[5] = -500;  // ankle roll: URDF effort 75 N·m
  bridge.command.torque[1] = 500;   // hip roll: 150 N·m
  bridge.Step();
  EXPECT_DOUBLE_EQ(bridge.drives().current[0], 2);
  EXPECT_DOUBLE_EQ(bridge.drives().current[5], -15);
  EXPECT_DOUBLE_EQ(bridge.drives().current[1], 30);
  EXPECT_EQ(bridge.drives().enabled, std::vector<int8_t>(kMotors, 1));
  EXPECT_EQ(bridge.status().state, bridge_status_t::STATE_RUNNING);
  EXPECT_EQ(bridge.status().saturations, 2);
  EXPECT_EQ(bridge.drives().num_motors, kMotors);
  EXPECT_EQ(bridge.drives().run_id, kRunId);
}

TEST(HwBridge, TorqueLimitShareIsOfThePeakCurrent) {
  Bridge bridge("torque_limit_share: 0.2");
  bridge.command.torque[1] = 500;
  bridge.Step();
  EXPECT_DOUBLE_EQ(bridge.drives().current[1], 6);  // 0.2 × 30 A
}

TEST(HwBridge, AnEmergencyStopIsLatched) {
  Bridge bridge;
  bridge.command.torque.assign(kMotors, 10);
  bridge.stop.stop = 0;
  bridge.Step(true, true);
  ASSERT_EQ(bridge.status().state, bridge_status_t::STATE_RUNNING);
  bridge.stop.stop = 1;
  bridge.Step(true, true);
  bridge.stop.stop = 0;
  for (int i = 0; i < 60; ++i) {
    bridge.Step(true, true);
    ASSERT_EQ(bridge.status().state, bridge_status_t::STATE_ESTOP);
    ASSERT_EQ(bridge.status().reason, bridge_status_t::REASON_OPERATOR);
  }
  EXPECT_EQ(bridge.drives().current, std::vector<double>(kMotors, 0.0));
  EXPECT_EQ(bridge.drives().enabled, std::vector<int8_t>(kMotors, 0));
}

TEST(HwBridge, MissingCommandsLeadToDampingAndToAStop) {
  Bridge bridge;
  bridge.command.torque.assign(kMotors, 10);
  bridge.Step();
  using S = bridge_status_t;
  // Three cycles late is not late; nine of damping; the ramp's 0.1 s.
  for (const auto& [state, cycles] :
       {std::pair(S::STATE_RUNNING, 3), std::pair(S::STATE_DAMPING, 9),
        std::pair(S::STATE_STOPPING, 50), std::pair(S::STATE_STOPPED, 1)}) {
    for (int i = 0; i < cycles; ++i) {
      bridge.Step(false);
      ASSERT_EQ(bridge.status().state, state) << i;
    }
  }
  EXPECT_EQ(bridge.drives().enabled, std::vector<int8_t>(kMotors, 0));
}

TEST(HwBridge, CommandsOfAnotherRunAreRefused) {
  Bridge bridge;
  bridge.command.run_id = kRunId + 1;
  bridge.Step();
  EXPECT_EQ(bridge.status().state, bridge_status_t::STATE_INIT);
  EXPECT_EQ(bridge.status().reason, bridge_status_t::REASON_COMMAND_RUN);
  EXPECT_EQ(bridge.status().refused_run, 1);
}

TEST(HwBridge, UnusableFeedbackKeepsTheLastSensorsAndStops) {
  Bridge bridge;
  bridge.feedback.current[0] = 3;
  bridge.Step();
  bridge.feedback.current[0] = std::numeric_limits<double>::infinity();
  bridge.Step();
  EXPECT_DOUBLE_EQ(bridge.sensors().joint_torque[0], 15);
  EXPECT_EQ(bridge.status().state, bridge_status_t::STATE_STOPPING);
  EXPECT_EQ(bridge.status().reason, bridge_status_t::REASON_FEEDBACK_NOT_FINITE);
}

TEST(HwBridge, DeclaresTheStagesOfTheTick) {
  Bridge bridge;
  const auto& stages = bridge.wiring().stages();
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].name, "sense");
  EXPECT_EQ(stages[1].name, "actuate");
  ASSERT_EQ(stages[1].inputs.size(), 2u);
  EXPECT_EQ(stages[1].inputs[1]->kind(), InputKind::kLatest);
}

struct ConfigCase {
  const char* text;
  const char* field;
};
class HwBridgeConfiguration : public testing::TestWithParam<ConfigCase> {};

TEST_P(HwBridgeConfiguration, IsRefusedByField) {
  try {
    Bridge bridge(GetParam().text);
    FAIL() << GetParam().text;
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_THAT(error.what(), HasSubstr("must"));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Fields, HwBridgeConfiguration,
    testing::Values(ConfigCase{"torque_limit_share: 0", "torque_limit_share"},
                    ConfigCase{"torque_limit_share: 1.1", "torque_limit_share"},
                    ConfigCase{"torque_limit_share: nan", "torque_limit_share"},
                    ConfigCase{"damping: inf", "damping"}, ConfigCase{"damping: -1", "damping"}));

TEST(HwBridge, AJointWithoutTorqueIsNamed) {
  std::string robot = ReadDeployed("dyros_legs.pbtxt");
  const std::string peak = "peak_current: 30";
  const size_t at = robot.find(peak);
  ASSERT_NE(at, std::string::npos);
  robot.replace(at, peak.size(), "peak_current: 0");
  try {
    Bridge bridge("", robot);
    FAIL();
  } catch (const ConfigError& error) {
    // Whoever notices first, robot or bridge, names what is wrong.
    EXPECT_THAT(error.what(), HasSubstr("peak_current"));
  }
}

}  // namespace
}  // namespace poise
