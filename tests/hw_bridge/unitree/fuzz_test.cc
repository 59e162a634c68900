// Bytes of states and commands that nobody would send: nothing outside limits leaves either end.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "hw_bridge/unitree/motion_switcher.h"
#include "hw_bridge/unitree_emulator/emulated_robot.h"
#include "tests/hw_bridge/unitree/robot_rig.h"

namespace poise {
namespace {

/// Changes some bytes anywhere, or a word into one of the numbers that are none.
template <class T>
void Mutate(std::mt19937* random, T* message) {
  std::array<uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), message, sizeof(T));
  const uint32_t kinds[] = {0x7FC00000, 0xFF800000, 0x7F7FFFFF, 0xFFFFFFFF, 0, 0x80000000};
  for (unsigned i = 0, count = 1 + (*random)() % 8; i < count; ++i) {
    if ((*random)() % 2 == 0) {
      bytes[(*random)() % sizeof(T)] = static_cast<uint8_t>((*random)());
    } else {
      std::memcpy(&bytes[(*random)() % (sizeof(T) / 4) * 4], &kinds[(*random)() % 6], 4);
    }
  }
  std::memcpy(static_cast<void*>(message), bytes.data(), sizeof(T));
}

TEST(UnitreeFuzz, HoweverBrokenTheStatesCommandsStayWithinLimits) {
  std::mt19937 random(11);
  auto rig = std::make_unique<RobotRig>("drives_hold: true on_lost_command: HOLD");
  rig->Start(5);
  int64_t stops = 0;
  for (int i = 0; i < FuzzSamples(); ++i) {
    const unitree::LowState clean = rig->robot.state;
    Mutate(&random, &rig->robot.state);
    rig->robot.state.tick = clean.tick;
    rig->motors_follow = false;
    rig->robot.own_crc = random() % 4 == 0;  // some with a wrong check sum
    rig->command.stiffness.assign(kMotors, random() % 3 == 0 ? 50 : 0);
    rig->Step(random() % 10 != 0);
    const uint32_t tick = rig->robot.state.tick;
    rig->robot.state = clean;
    rig->robot.state.tick = tick;
    ASSERT_EQ(rig->Broken(), "");
    if (rig->status().state >= bridge_status_t::STATE_STOPPED) {
      ++stops;
      // An emergency stop begins with damping, which a limit may take from by tau.
      const bool damps = rig->status().state == bridge_status_t::STATE_ESTOP;
      ASSERT_TRUE(damps || rig->AtRest());
      for (size_t j = 0; j < kMotors; ++j)
        ASSERT_TRUE(rig->told(j).kp == 0 && rig->told(j).dq == 0);
      rig = std::make_unique<RobotRig>("drives_hold: true on_lost_command: HOLD");
      rig->Start(5);
    }
  }
  EXPECT_GT(stops, 0) << "none of the mutations was noticed";
}

TEST(UnitreeFuzz, HoweverBrokenTheCommandsTheEmulatedRobotTakesOnlyNumbers) {
  std::mt19937 random(12);
  RobotRig rig;
  rig.Start(5);
  UnitreeEmulatorConfig config;
  config.set_layout(unitree::UnitreeBusConfig::G1);
  unitree::EmulatedRobot robot(config, *rig.model, 0.002);
  drive_command_t motors;
  MessageTraits<drive_command_t>::Resize(motors, MessageCounts{kMotors});
  int64_t taken = 0;
  for (int i = 0; i < FuzzSamples(); ++i) {
    unitree::LowCmd command = rig.robot.command;
    Mutate(&random, &command);
    if (random() % 4 != 0) command.crc = unitree::CrcOf(command);
    taken += robot.Take(command) ? 1 : 0;
    robot.Act(&motors);
    for (size_t j = 0; j < kMotors; ++j) {
      ASSERT_TRUE(std::isfinite(motors.current[j] + motors.position[j] + motors.velocity[j]));
      ASSERT_TRUE(motors.stiffness[j] >= 0 && motors.damping[j] >= 0);
    }
  }
  EXPECT_GT(taken, 0);
  EXPECT_GT(robot.refused(), 0);
}

TEST(UnitreeFuzz, AnswersOfAnyTextAreReadOrRefused) {
  std::mt19937 random(13);
  const std::string answer = R"({"form":"0","name":"ai"})";
  int read = 0;
  for (int i = 0; i < FuzzSamples(); ++i) {
    std::string text = answer;
    for (unsigned k = 0, count = random() % 4; k < count; ++k) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    read += unitree::ModeOf(text).has_value() ? 1 : 0;
  }
  EXPECT_GT(read, 0);
  EXPECT_LT(read, FuzzSamples());
}

}  // namespace
}  // namespace poise
