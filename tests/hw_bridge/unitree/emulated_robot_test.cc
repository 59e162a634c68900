// The emulated robot: rounding, delay, its own watchdog, what it refuses.
#include "hw_bridge/unitree_emulator/emulated_robot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "components/framework/configuration/configuration.h"
#include "hw_bridge/drive/units.h"
#include "tests/hw_bridge/unitree/robot_rig.h"

namespace poise {
namespace {

class EmulatedRobotTest : public ::testing::Test {
 protected:
  EmulatedRobotTest() {
    MessageTraits<drive_feedback_t>::Resize(feedback_, MessageCounts{kMotors, 2});
    MessageTraits<drive_command_t>::Resize(motors_, MessageCounts{kMotors});
    rig_.Start(5);
    Make("");
  }
  void Make(const std::string& text) {
    UnitreeEmulatorConfig config;
    ParseTextProto(text, "test", &config);
    robot_ = std::make_unique<unitree::EmulatedRobot>(config, *rig_.model, 0.002);
  }
  unitree::LowCmd Command(float torque) {
    unitree::LowCmd command = rig_.robot.command;
    for (const size_t slot : rig_.slots) command.motor_cmd[slot].tau = torque;
    command.crc = unitree::CrcOf(command);
    return command;
  }
  double Torque() const { return JointTorque(rig_.model->motors()[0], motors_.current[0]); }

  RobotRig rig_;
  drive_feedback_t feedback_;
  drive_command_t motors_;
  std::unique_ptr<unitree::EmulatedRobot> robot_;
};

TEST_F(EmulatedRobotTest, SaysWhatIsSensedTo32Bits) {
  feedback_.position_counts[0] = 12345;
  feedback_.velocity[0] = 0.3000000001;
  feedback_.imu_acceleration[2] = 9.8066500001;
  feedback_.imu_orientation[0] = 0.6;
  feedback_.imu_orientation[1] = -0.8;
  const unitree::LowState* state = robot_->State(feedback_, 4);
  ASSERT_NE(state, nullptr);
  const double q = JointPositionOf(rig_.model->motors()[0], 12345);
  EXPECT_EQ(state->motor_state[rig_.slots[0]].q, static_cast<float>(q));
  EXPECT_EQ(state->motor_state[rig_.slots[0]].dq, 0.3F);
  EXPECT_EQ(state->imu_state.accelerometer[2], 9.80665F);
  EXPECT_THAT(state->imu_state.quaternion, ::testing::ElementsAre(0.6F, -0.8F, 0, 0));
  EXPECT_EQ(state->crc, unitree::CrcOf(*state));
  EXPECT_EQ(state->tick, 4U);
}

TEST_F(EmulatedRobotTest, PlacedSomewhereElseNoStateOfBeforeComesLate) {
  Make("state_delay: 2");
  const auto position = [&](int64_t counts) {
    feedback_.position_counts[0] = counts;
    return robot_->State(feedback_, 0)->motor_state[rig_.slots[0]].q;
  };
  EXPECT_EQ(position(0), 0);
  EXPECT_EQ(position(8192), 0);
  robot_->Place();
  EXPECT_NE(position(50 * 8192), 0);
}

TEST_F(EmulatedRobotTest, DelaysStatesAndCommands) {
  Make("state_delay: 2 command_delay: 1");
  for (int64_t cycle = 0; cycle < 6; ++cycle) {
    feedback_.position_counts[0] = 1000 * cycle;
    const unitree::LowState* state = robot_->State(feedback_, static_cast<uint32_t>(cycle));
    const double q =
        JointPositionOf(rig_.model->motors()[0], 1000 * std::max<int64_t>(0, cycle - 2));
    EXPECT_EQ(state->motor_state[rig_.slots[0]].q, static_cast<float>(q)) << cycle;
    ASSERT_TRUE(robot_->Take(Command(static_cast<float>(cycle))));
    robot_->Act(&motors_);
    EXPECT_NEAR(Torque(), static_cast<double>(std::max<int64_t>(0, cycle - 1)), 1e-5);
  }
}

TEST_F(EmulatedRobotTest, DampsByItselfWithoutCommandsAndFollowsAgain) {
  Make("watchdog: 0.02");
  ASSERT_TRUE(robot_->Take(Command(5)));
  int cycles = 0;
  for (; !robot_->damping() && cycles < 100; ++cycles) robot_->Act(&motors_);
  // The command's own cycle and ten more, which are 20 ms; the next damps.
  EXPECT_EQ(cycles, 12);
  EXPECT_EQ(motors_.current[0], 0);
  EXPECT_EQ(motors_.damping[0], 8);
  ASSERT_TRUE(robot_->Take(Command(5)));
  robot_->Act(&motors_);
  EXPECT_FALSE(robot_->damping());
  EXPECT_NEAR(Torque(), 5, 1e-5);
}

TEST_F(EmulatedRobotTest, RefusesWhatARobotWould) {
  unitree::LowCmd command = Command(5);
  command.crc ^= 1;
  EXPECT_FALSE(robot_->Take(command));
  command = Command(5);
  command.mode_machine = 4;
  command.crc = unitree::CrcOf(command);
  EXPECT_FALSE(robot_->Take(command));
  robot_->SetMakerActive(true);
  EXPECT_FALSE(robot_->Take(Command(5)));
  robot_->SetMakerActive(false);
  EXPECT_TRUE(robot_->Take(Command(5)));
  EXPECT_EQ(robot_->refused(), 3);
}

TEST_F(EmulatedRobotTest, HasTroublesOfATime) {
  Make(
      "trouble { kind: BUTTON button: \"B\" from: 1 until: 2 } trouble { kind: NO_STATE from: 3 }"
      "trouble { kind: HOT_MOTOR joint: \"left_knee_pitch\" value: 120 from: 1 }");
  robot_->SetTime(0.5);
  EXPECT_EQ(robot_->State(feedback_, 1)->wireless_remote[3], 0);
  robot_->SetTime(1.5);
  const unitree::LowState* state = robot_->State(feedback_, 2);
  EXPECT_EQ(state->wireless_remote[3], 0x02);
  const auto knee = static_cast<size_t>(rig_.model->FindJoint("left_knee_pitch"));
  EXPECT_EQ(state->motor_state[rig_.slots[knee]].temperature[1], 120);
  robot_->SetTime(2.5);
  EXPECT_EQ(robot_->State(feedback_, 3)->wireless_remote[3], 0);
  robot_->SetTime(3);
  EXPECT_EQ(robot_->State(feedback_, 4), nullptr);
}

TEST_F(EmulatedRobotTest, RefusesAButtonWithoutAName) {
  try {
    Make("trouble { kind: NO_STATE } trouble { kind: BUTTON from: 1 }");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), "trouble[1].button");
  }
}

}  // namespace
}  // namespace poise
