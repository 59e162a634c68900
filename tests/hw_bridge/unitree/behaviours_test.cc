// What the bridge does on a Unitree robot, on the commands that leave for it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "hw_bridge/unitree/remote.h"
#include "tests/hw_bridge/unitree/robot_rig.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using Status = bridge_status_t;

std::string ProblemOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

TEST(UnitreeStart, WaitsForTheRobotAndReleasesItsMakersController) {
  RobotRig rig;
  rig.robot.mode = "ai";
  rig.Open();
  EXPECT_EQ(rig.robot.releases_asked, 1);
}

TEST(UnitreeStart, SaysWhatIsWrongAndWhatToDo) {
  {
    RobotRig rig;
    rig.robot.silent = true;
    EXPECT_THAT(ProblemOf([&] { rig.Open(); }), HasSubstr("is the robot on"));
  }
  {
    RobotRig rig;
    rig.robot.answers = false;
    EXPECT_THAT(ProblemOf([&] { rig.Open(); }), HasSubstr("motion switcher"));
  }
  {
    RobotRig rig("", "release: false");
    rig.robot.mode = "ai";
    EXPECT_THAT(ProblemOf([&] { rig.Open(); }), HasSubstr("\"ai\""));
    EXPECT_EQ(rig.robot.releases_asked, 0);
    EXPECT_EQ(rig.robot.commands, 0) << "a command into another's control";
  }
  {
    RobotRig rig;
    rig.robot.own_crc = true;
    EXPECT_THAT(ProblemOf([&] { rig.Open(); }), HasSubstr("check sum"));
  }
}

TEST(UnitreeStart, ConfigurationsThatCannotWorkAreRefused) {
  EXPECT_THAT(ProblemOf([] { RobotRig rig("", "stop_button: \"Z\""); }), HasSubstr("\"Z\""));
  EXPECT_THAT(ProblemOf([] { RobotRig rig("", "input_wait: 2000"); }), HasSubstr("input_wait"));
  EXPECT_THAT(ProblemOf([] { RobotRig rig("", "layout: H1_2 slot { joint: \"tail\" slot: 3 }"); }),
              HasSubstr("tail"));
  EXPECT_THAT(ProblemOf([] { RobotRig rig("ethercat { link { udp {} } }"); }),
              HasSubstr("one bus"));
}

TEST(UnitreeStart, OnlyAnEmulatedRobotNeedsAPort) {
  EXPECT_FALSE(RobotRig().HasInput("drive_feedback"));
  EXPECT_TRUE(RobotRig("", "follow_robot: false").HasInput("drive_feedback"));
}

TEST(UnitreeCommands, CarryTheRobotsTypeACheckSumAndNothingInOtherSlots) {
  RobotRig rig;
  rig.Start(5);
  ASSERT_EQ(rig.status().state, Status::STATE_RUNNING);
  const unitree::LowCmd& command = rig.robot.command;
  EXPECT_EQ(command.mode_pr, 0);
  EXPECT_EQ(command.mode_machine, 5);
  EXPECT_EQ(command.crc, unitree::CrcOf(command));
  for (const uint32_t word : command.reserve) EXPECT_EQ(word, 0U);
  for (size_t slot = 0; slot < unitree::kNumSlots; ++slot) {
    const unitree::MotorCmd& motor = command.motor_cmd[slot];
    const bool ours = std::find(rig.slots.begin(), rig.slots.end(), slot) != rig.slots.end();
    EXPECT_EQ(motor.mode, ours ? 1 : 0) << slot;
    EXPECT_FLOAT_EQ(motor.tau, ours ? 5 : 0) << slot;
    EXPECT_EQ(motor.kp, 0) << slot;
    EXPECT_EQ(motor.kd, 0) << slot;
  }
}

TEST(UnitreeCommands, DampUntilTheFirstOneAndAfterTheLast) {
  RobotRig rig;
  rig.Open();
  rig.command.torque.assign(kMotors, 5);
  rig.Step(false);
  EXPECT_TRUE(rig.AtRest());
  EXPECT_EQ(rig.told(0).kd, 8);
  EXPECT_EQ(rig.told(0).mode, 1);
  rig.Run(10);
  EXPECT_FALSE(rig.AtRest());
  EXPECT_EQ(rig.bridge->Close(), "");
  EXPECT_TRUE(rig.AtRest());
  EXPECT_EQ(rig.told(0).kd, 8);
}

TEST(UnitreeCommands, CarryStiffnessAndDampingSuchThatTheirSumIsTheTorque) {
  RobotRig rig;
  rig.Start(5);
  rig.command.stiffness.assign(kMotors, 30);
  rig.command.damping.assign(kMotors, 2);
  for (size_t j = 0; j < kMotors; ++j) {
    rig.command.position[j] = static_cast<double>(rig.state_of(j).q) + 0.02;
  }
  rig.command.velocity.assign(kMotors, 0.1);
  rig.Run(20);
  ASSERT_EQ(rig.status().state, Status::STATE_RUNNING);
  for (size_t j = 0; j < kMotors; ++j) {
    EXPECT_FLOAT_EQ(rig.told(j).kp, 30);
    EXPECT_FLOAT_EQ(rig.told(j).kd, 2);
    EXPECT_FLOAT_EQ(rig.told(j).dq, 0.1F);
    EXPECT_NEAR(rig.told(j).tau, 5, 1e-5);
    // Stiffness 0.6, damping 0.2 N·m above the torque: what the planned motion is ahead.
    EXPECT_NEAR(rig.TorqueOf(j), 5.8, 1e-2);
    EXPECT_NEAR(rig.status().applied_torque[j], 5.8, 1e-2);
  }
}

TEST(UnitreeCommands, StiffnessAndDampingBreakNoLimit) {
  RobotRig rig;
  rig.Start(5);
  rig.command.stiffness.assign(kMotors, 1e9);
  rig.command.damping.assign(kMotors, 1e9);
  rig.command.position.assign(kMotors, 100);
  rig.command.velocity.assign(kMotors, -1e6);
  rig.Run(20);
  for (size_t j = 0; j < kMotors; ++j) {
    const robot::MotorModel& motor = rig.model->motors()[j];
    const double limit =
        std::min(rig.model->joints()[j].effort, motor.torque_per_ampere() * motor.peak_current);
    EXPECT_LE(std::abs(rig.TorqueOf(j)), limit * 1.001) << j;
    EXPECT_LE(rig.told(j).kd, motor.reflected_inertia / 1e-3 + 1e-6);
    EXPECT_LE(rig.told(j).q, rig.model->joints()[j].upper + 0.051);
  }
  EXPECT_NE(rig.status().saturated[0] & Status::LIMIT_IMPEDANCE, 0);
}

TEST(UnitreeCommands, OneThatIsNoNumberOrNegativeIsRefused) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -1.0}) {
    RobotRig rig;
    rig.Start(5);
    rig.command.stiffness[3] = bad;
    rig.Step();
    EXPECT_EQ(rig.status().refused_not_finite, 1);
    EXPECT_EQ(rig.told(3).kp, 0);
  }
}

TEST(UnitreeStop, TheRemotesButtonsAreAnEmergencyStop) {
  for (const std::string button : {"select", "B"}) {
    RobotRig rig;
    rig.Start(5);
    unitree::SetButtons(unitree::ButtonsOf({button}), rig.robot.state.wireless_remote);
    rig.Step();
    EXPECT_EQ(rig.status().state, Status::STATE_ESTOP) << button;
    EXPECT_EQ(rig.status().reason, Status::REASON_REMOTE_STOP);
    for (size_t j = 0; j < kMotors; ++j) EXPECT_EQ(rig.told(j).tau, 0) << "its very next command";
    unitree::SetButtons(0, rig.robot.state.wireless_remote);
    rig.Run(100);
    EXPECT_EQ(rig.status().state, Status::STATE_ESTOP) << "let go of, it stays";
    EXPECT_TRUE(rig.AtRest());
  }
}

TEST(UnitreeStop, OtherButtonsAreNot) {
  RobotRig rig;
  rig.Start(5);
  unitree::SetButtons(unitree::ButtonsOf({"A", "up", "L1"}), rig.robot.state.wireless_remote);
  rig.Run(10);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
}

TEST(UnitreeStop, AHotMotorAndALowVoltageStopByName) {
  {
    RobotRig rig;
    rig.Start(5);
    rig.state_of(4).temperature[1] = 91;
    rig.Step();
    EXPECT_EQ(rig.status().state, Status::STATE_STOPPING);
    EXPECT_EQ(rig.status().reason, Status::REASON_MOTOR_TEMPERATURE);
    EXPECT_EQ(rig.status().reason_joint, 4);
    EXPECT_EQ(rig.bus_status().temperature[4], 91);
  }
  {
    RobotRig rig;
    rig.Start(5);
    rig.state_of(2).vol = 39;
    rig.Step();
    EXPECT_EQ(rig.status().reason, Status::REASON_SUPPLY_VOLTAGE);
    EXPECT_EQ(rig.status().reason_joint, 2);
    EXPECT_EQ(rig.bus_status().voltage[2], 39);
  }
  {
    RobotRig rig;
    for (size_t j = 0; j < kMotors; ++j) rig.state_of(j).vol = 0;  // they report none
    rig.Start(5);
    EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  }
}

TEST(UnitreeStop, AMotorsErrorStopsAllAndFreesIt) {
  RobotRig rig;
  rig.Start(5);
  rig.state_of(7).motorstate = 4;
  rig.Step();
  EXPECT_EQ(rig.status().state, Status::STATE_STOPPING);
  EXPECT_EQ(rig.status().reason, Status::REASON_DRIVE_FAULT);
  EXPECT_EQ(rig.status().reason_joint, 7);
  EXPECT_EQ(rig.told(7).mode, 0);
  EXPECT_EQ(rig.bus_status().error_code[7], 4);
  for (size_t j = 0; j < kMotors; ++j) EXPECT_EQ(rig.told(j).tau, 0);
}

TEST(UnitreeStop, AnotherModeMachineStops) {
  RobotRig rig;
  rig.Start(5);
  rig.robot.state.mode_machine = 6;
  rig.Step();
  EXPECT_EQ(rig.status().reason, Status::REASON_ROBOT_MODE);
}

TEST(UnitreeStop, FiveCyclesWithoutAStateStop) {
  RobotRig rig;
  rig.Start(5);
  rig.robot.silent = true;
  EXPECT_EQ(rig.CyclesUntil([&] { return rig.status().state != Status::STATE_RUNNING; }), 4);
  EXPECT_EQ(rig.status().reason, Status::REASON_BUS_LINK);
  for (size_t j = 0; j < kMotors; ++j) EXPECT_EQ(rig.told(j).tau, 0);
}

TEST(UnitreeStop, DamagedAndRepeatedStatesAreNone) {
  {
    RobotRig rig;
    rig.Start(5);
    rig.robot.own_crc = true;  // of the last state
    EXPECT_EQ(rig.CyclesUntil([&] { return rig.status().state != Status::STATE_RUNNING; }), 4);
    EXPECT_EQ(rig.status().reason, Status::REASON_BUS_INPUTS);
    EXPECT_GE(rig.status().working_counter_errors, 5);
  }
  {
    RobotRig rig;
    rig.Start(5);
    const double before = rig.readings().joint_position[0];
    rig.state_of(0).q += 0.01F;
    rig.robot.state.tick -= 2;  // Step adds 2: the last state's again
    rig.Step();
    EXPECT_EQ(rig.readings().joint_position[0], before);
    EXPECT_EQ(rig.status().frames_lost, 1);
  }
}

TEST(UnitreeStates, TellTheMotorsVelocityAndTheOrientationOfTheImu) {
  RobotRig rig;
  rig.Start(5);
  rig.state_of(3).dq = 0.25F;
  rig.robot.state.imu_state.quaternion[0] = 0.6F;
  rig.robot.state.imu_state.quaternion[2] = 0.8F;
  rig.Step();
  EXPECT_EQ(rig.readings().joint_velocity[3], 0.25);
  EXPECT_NEAR(rig.readings().imu_orientation[0], 0.6, 1e-7);
  EXPECT_NEAR(rig.readings().imu_orientation[2], 0.8, 1e-7);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
}

TEST(UnitreeStop, AnothersDamagedStatesDoNotHideTheRobots) {
  RobotRig rig;
  rig.Start(5);
  unitree::LowState damaged = rig.robot.state;
  damaged.motor_state[0].q = 3;
  damaged.crc ^= 1;
  rig.robot.others.assign(5, damaged);
  const int64_t before = rig.status().working_counter_errors;
  for (int i = 0; i < 50; ++i) {
    rig.state_of(0).q += 1e-4F;
    rig.Step();
    ASSERT_EQ(rig.status().state, Status::STATE_RUNNING) << i;
    EXPECT_NEAR(rig.readings().joint_position[0], static_cast<double>(rig.state_of(0).q), 1e-4);
  }
  EXPECT_EQ(rig.status().frames_lost, 0);
  EXPECT_EQ(rig.status().working_counter_errors, before + 250);
}

TEST(UnitreeStop, APositionThatIsNoNumberStopsByName) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), 1e30F}) {
    RobotRig rig;
    rig.Start(5);
    rig.state_of(5).q = bad;
    rig.motors_follow = false;
    rig.Step();
    EXPECT_EQ(rig.status().state, Status::STATE_STOPPING);
    EXPECT_EQ(rig.status().reason, Status::REASON_FEEDBACK_NOT_FINITE);
    EXPECT_EQ(rig.status().reason_joint, 5);
  }
}

TEST(UnitreeStop, LostCommandsAreHeldDampedAndStoppedByTheMotorsThemselves) {
  RobotRig rig("drives_hold: true on_lost_command: HOLD hold_time: 0.1");
  rig.Start(5);
  rig.CyclesUntil([&] { return rig.status().state == Status::STATE_HOLDING; }, false);
  EXPECT_NEAR(rig.told(0).tau, 5, 1e-4);
  EXPECT_GT(rig.told(0).kp, 0);
  EXPECT_GT(rig.told(0).kd, 0);
  EXPECT_NEAR(rig.told(0).q, rig.state_of(0).q, 1e-4);
  EXPECT_NE(rig.CyclesUntil([&] { return rig.status().state == Status::STATE_DAMPING; }, false),
            -1);
  EXPECT_NEAR(rig.told(0).tau, 0, 1e-6);
  EXPECT_EQ(rig.told(0).kp, 0);
  EXPECT_GT(rig.told(0).kd, 0);
  EXPECT_NE(rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPED; }, false),
            -1);
  EXPECT_TRUE(rig.AtRest());
}

TEST(UnitreeStart, ARobotThatHangsIsHeldAndHandedOver) {
  RobotRig rig("drives_hold: true hold_before_command: true");
  rig.Open();
  for (int i = 0; i < 20; ++i) rig.Step(false);
  ASSERT_EQ(rig.status().state, Status::STATE_HOLDING);
  EXPECT_NEAR(rig.told(3).q, 0.6, 1e-3) << "where it hung";
  EXPECT_GT(rig.told(3).kp, 0);
  EXPECT_NEAR(rig.told(3).tau, 0, 1e-4);
  rig.command.torque.assign(kMotors, 5);
  rig.Run(30);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  EXPECT_EQ(rig.told(3).kp, 0);
  EXPECT_NEAR(rig.told(3).tau, 5, 1e-5);
}

TEST(UnitreeStop, AnOperatorsStopLatchesUntilAReset) {
  RobotRig rig;
  rig.Start(5);
  rig.stop.stop = 1;
  rig.Step();
  EXPECT_EQ(rig.status().state, Status::STATE_ESTOP);
  rig.stop.stop = 0;
  rig.command.torque.assign(kMotors, 0);
  rig.Run(100);
  EXPECT_TRUE(rig.AtRest());
  rig.stop.reset = 1;
  rig.Run(600);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
}

TEST(UnitreeStop, ASignalAndATiltAreStops) {
  {
    RobotRig rig;
    rig.Start(5);
    rig.signal = 1;
    rig.Step();
    EXPECT_EQ(rig.status().reason, Status::REASON_SIGNAL);
  }
  {
    RobotRig rig;
    rig.Start(5);
    rig.robot.state.imu_state.accelerometer[2] = 0;
    rig.robot.state.imu_state.accelerometer[0] = 9.80665F;
    EXPECT_NE(rig.CyclesUntil([&] { return rig.status().reason == Status::REASON_BODY_TILT; }), -1);
  }
}

TEST(UnitreeStop, TorqueThatIsNotTheCommandedOneStops) {
  RobotRig rig;
  rig.Start(5);
  rig.motors_follow = false;
  rig.state_of(1).tau_est = 60;
  EXPECT_NE(
      rig.CyclesUntil([&] { return rig.status().reason == Status::REASON_TORQUE_IMPLAUSIBLE; }),
      -1);
  EXPECT_EQ(rig.status().reason_joint, 1);
}

}  // namespace
}  // namespace poise
