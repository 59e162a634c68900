// Check sums, layouts, slots and buttons, beside what others say of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <random>
#include <vector>

#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/motion_switcher.h"
#include "hw_bridge/unitree/motor_slots.h"
#include "hw_bridge/unitree/remote.h"

namespace poise::unitree {
namespace {

using ::testing::ElementsAre;

// Sizes and places that the makers' programs compute with: `sizeof(LowCmd) >> 2` less one words are
// summed, and the sum is the last word (unitree_sdk2, low-level examples).
static_assert(sizeof(MotorCmd) == 28 && sizeof(LowCmd) == 1004);
static_assert(offsetof(LowCmd, motor_cmd) == 4 && offsetof(LowCmd, crc) == 1000);
static_assert(sizeof(ImuState) == 56 && sizeof(MotorState) == 56 && sizeof(LowState) == 2092);
static_assert(offsetof(LowState, tick) == 12 && offsetof(LowState, imu_state) == 16);
static_assert(offsetof(LowState, motor_state) == 72 && offsetof(LowState, crc) == 2088);
static_assert(offsetof(LowState, wireless_remote) == 2032);

/// The sum as the makers' programs compute it, bit by bit (unitree_sdk2, low-level examples).
uint32_t MakersCrc(const std::vector<uint32_t>& words) {
  uint32_t crc = 0xFFFFFFFF;
  for (const uint32_t word : words) {
    for (uint32_t bit = 1U << 31; bit != 0; bit >>= 1) {
      crc = (crc << 1) ^ ((crc >> 31) != 0 ? 0x04C11DB7 : 0);
      if ((word & bit) != 0) crc ^= 0x04C11DB7;
    }
  }
  return crc;
}

template <class T>
std::vector<uint32_t> WordsOf(const T& message) {
  std::vector<uint32_t> words(sizeof(T) / 4 - 1);
  std::memcpy(words.data(), &message, words.size() * 4);
  return words;
}

TEST(UnitreeCrc, IsThatOfTheMakersPrograms) {
  std::mt19937 random(3);
  for (const size_t size : {0, 1, 2, 250, 522}) {
    std::vector<uint32_t> words(size);
    for (uint32_t& word : words) word = static_cast<uint32_t>(random());
    EXPECT_EQ(Crc32(words), MakersCrc(words)) << size;
  }
}

// CRC-32/MPEG-2 of "123456789" is 0x0376E6E7 (catalogue of parametrised CRC algorithms); here of
// its first eight bytes as two words, and then of the ninth bit by bit.
TEST(UnitreeCrc, HasTheCataloguesParameters) {
  uint32_t crc = Crc32(std::vector<uint32_t>{0x31323334, 0x35363738}) ^ uint32_t { '9' } << 24;
  for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 31) != 0 ? 0x04C11DB7 : 0);
  EXPECT_EQ(crc, 0x0376E6E7U);
}

/// Fields of all bytes; what C fills up between them stays zero.
LowCmd AnyCommand(std::mt19937* random) {
  LowCmd command;
  std::memset(static_cast<void*>(&command), 0, sizeof command);
  const auto any = [random] { return static_cast<float>((*random)() % 1000) - 500; };
  command.mode_pr = 1;
  command.mode_machine = 5;
  for (MotorCmd& motor : command.motor_cmd) {
    motor.mode = static_cast<uint8_t>((*random)());
    motor.q = any();
    motor.dq = any();
    motor.tau = any();
    motor.kp = any();
    motor.kd = any();
    motor.reserve = static_cast<uint32_t>((*random)());
  }
  for (uint32_t& word : command.reserve) word = static_cast<uint32_t>((*random)());
  return command;
}

TEST(UnitreeCrc, IsOfTheMessageAsItLiesInMemory) {
  std::mt19937 random(4);
  for (int i = 0; i < 20; ++i) {
    const LowCmd command = AnyCommand(&random);
    EXPECT_EQ(CrcOf(command), MakersCrc(WordsOf(command)));
  }
  LowState state;
  std::memset(static_cast<void*>(&state), 0, sizeof state);
  state.version[1] = 7;
  state.mode_machine = 5;
  state.tick = 123456;
  state.imu_state.quaternion[0] = 1;
  state.imu_state.rpy[2] = -0.25F;
  state.imu_state.temperature = -3;
  for (MotorState& motor : state.motor_state) {
    motor.mode = 1;
    motor.q = 0.5F;
    motor.temperature[1] = 41;
    motor.sensor[1] = 9;
    motor.motorstate = 0x80000000U;
    motor.reserve[3] = 2;
  }
  state.wireless_remote[39] = 0xA5;
  state.reserve[0] = 11;
  EXPECT_EQ(CrcOf(state), MakersCrc(WordsOf(state)));
}

TEST(UnitreeCrc, DoesNotSumWhatLiesBetweenFields) {
  std::mt19937 random(5);
  LowCmd command = AnyCommand(&random);
  const uint32_t clean = CrcOf(command);
  reinterpret_cast<uint8_t*>(&command)[3] = 0xFF;  // after mode_machine
  EXPECT_EQ(CrcOf(command), clean);
}

std::vector<size_t> SlotsOf(const std::vector<std::string>& joints,
                            UnitreeBusConfig::Layout layout = UnitreeBusConfig::BY_ROBOT,
                            const std::vector<std::pair<std::string, uint32_t>>& changes = {}) {
  UnitreeBusConfig config;
  for (const auto& [joint, slot] : changes) {
    MotorSlot* change = config.add_slot();
    change->set_joint(joint);
    change->set_slot(slot);
  }
  return MotorSlots(joints, layout, config.slot());
}

struct MakersIndex {
  const char* joint;  // of the makers' URDF
  size_t slot;
};

/// Whole robots, all joints at once.
void ExpectSlots(const std::vector<MakersIndex>& table,
                 UnitreeBusConfig::Layout layout = UnitreeBusConfig::BY_ROBOT) {
  std::vector<std::string> joints;
  std::vector<size_t> slots;
  for (const MakersIndex& row : table) {
    joints.emplace_back(row.joint);
    slots.push_back(row.slot);
  }
  EXPECT_EQ(SlotsOf(joints, layout), slots);
}

// enum G1JointIndex of unitree_sdk2_python, example/g1/low_level/g1_low_level_example.py (commit
// 21e44b7c), beside the joints of g1_29dof_rev_1_0.urdf.
const std::vector<MakersIndex> kG1 = {{"left_hip_pitch_joint", 0},
                                      {"left_hip_roll_joint", 1},
                                      {"left_hip_yaw_joint", 2},
                                      {"left_knee_joint", 3},
                                      {"left_ankle_pitch_joint", 4},
                                      {"left_ankle_roll_joint", 5},
                                      {"right_hip_pitch_joint", 6},
                                      {"right_hip_roll_joint", 7},
                                      {"right_hip_yaw_joint", 8},
                                      {"right_knee_joint", 9},
                                      {"right_ankle_pitch_joint", 10},
                                      {"right_ankle_roll_joint", 11},
                                      {"waist_yaw_joint", 12},
                                      {"waist_roll_joint", 13},
                                      {"waist_pitch_joint", 14},
                                      {"left_shoulder_pitch_joint", 15},
                                      {"left_shoulder_roll_joint", 16},
                                      {"left_shoulder_yaw_joint", 17},
                                      {"left_elbow_joint", 18},
                                      {"left_wrist_roll_joint", 19},
                                      {"left_wrist_pitch_joint", 20},
                                      {"left_wrist_yaw_joint", 21},
                                      {"right_shoulder_pitch_joint", 22},
                                      {"right_shoulder_roll_joint", 23},
                                      {"right_shoulder_yaw_joint", 24},
                                      {"right_elbow_joint", 25},
                                      {"right_wrist_roll_joint", 26},
                                      {"right_wrist_pitch_joint", 27},
                                      {"right_wrist_yaw_joint", 28}};

TEST(MotorSlots, OfAG1With29JointsAreTheMakersNumbers) {
  ExpectSlots(kG1);
  ExpectSlots(kG1, UnitreeBusConfig::G1);
}

// The same file: 13, 14, 20, 21, 27 and 28 are "INVALID for g1 23dof".
TEST(MotorSlots, OfAG1With23JointsLeaveTheMakersGaps) {
  std::vector<MakersIndex> table;
  for (const MakersIndex& row : kG1) {
    const bool invalid = row.slot == 13 || row.slot == 14 || row.slot == 20 || row.slot == 21 ||
                         row.slot == 27 || row.slot == 28;
    if (!invalid) table.push_back(row);
  }
  ASSERT_EQ(table.size(), 23U);
  ExpectSlots(table);
}

// enum G1JointIndex of unitree_sdk2, example/g1/low_level/g1_23dof_example.cpp (commit 5dd20b58).
TEST(MotorSlots, OfAnOldG1With23JointsHaveNoGaps) {
  ExpectSlots({{"left_hip_pitch_joint", 0},
               {"left_hip_roll_joint", 1},
               {"left_hip_yaw_joint", 2},
               {"left_knee_joint", 3},
               {"left_ankle_pitch_joint", 4},
               {"left_ankle_roll_joint", 5},
               {"right_hip_pitch_joint", 6},
               {"right_hip_roll_joint", 7},
               {"right_hip_yaw_joint", 8},
               {"right_knee_joint", 9},
               {"right_ankle_pitch_joint", 10},
               {"right_ankle_roll_joint", 11},
               {"waist_yaw_joint", 12},
               {"left_shoulder_pitch_joint", 13},
               {"left_shoulder_roll_joint", 14},
               {"left_shoulder_yaw_joint", 15},
               {"left_elbow_joint", 16},
               {"left_wrist_roll_joint", 17},
               {"right_shoulder_pitch_joint", 18},
               {"right_shoulder_roll_joint", 19},
               {"right_shoulder_yaw_joint", 20},
               {"right_elbow_joint", 21},
               {"right_wrist_roll_joint", 22}},
              UnitreeBusConfig::G1_23_OLD);
}

// class H1_2_JointIndex of unitree_sdk2_python, example/h1_2/low_level/h1_2_low_level_example.py
// (commit 21e44b7c), beside the joints of h1_2_handless.urdf (unitree_ros, commit c817a6ad).
TEST(MotorSlots, OfAnH12AreTheMakersNumbers) {
  const std::vector<MakersIndex> table = {{"left_hip_yaw_joint", 0},
                                          {"left_hip_pitch_joint", 1},
                                          {"left_hip_roll_joint", 2},
                                          {"left_knee_joint", 3},
                                          {"left_ankle_pitch_joint", 4},
                                          {"left_ankle_roll_joint", 5},
                                          {"right_hip_yaw_joint", 6},
                                          {"right_hip_pitch_joint", 7},
                                          {"right_hip_roll_joint", 8},
                                          {"right_knee_joint", 9},
                                          {"right_ankle_pitch_joint", 10},
                                          {"right_ankle_roll_joint", 11},
                                          {"torso_joint", 12},
                                          {"left_shoulder_pitch_joint", 13},
                                          {"left_shoulder_roll_joint", 14},
                                          {"left_shoulder_yaw_joint", 15},
                                          {"left_elbow_joint", 16},
                                          {"left_wrist_roll_joint", 17},
                                          {"left_wrist_pitch_joint", 18},
                                          {"left_wrist_yaw_joint", 19},
                                          {"right_shoulder_pitch_joint", 20},
                                          {"right_shoulder_roll_joint", 21},
                                          {"right_shoulder_yaw_joint", 22},
                                          {"right_elbow_joint", 23},
                                          {"right_wrist_roll_joint", 24},
                                          {"right_wrist_pitch_joint", 25},
                                          {"right_wrist_yaw_joint", 26}};
  ExpectSlots(table);
  ExpectSlots(table, UnitreeBusConfig::H1_2);
}

TEST(MotorSlots, MayBeChangedAndRefuseWhatCannotBe) {
  EXPECT_THAT(SlotsOf({"neck", "left_knee"}, UnitreeBusConfig::G1, {{"neck", 30}}),
              ElementsAre(30, 3));
  EXPECT_THROW(SlotsOf({"neck"}), UnitreeError);
  EXPECT_THROW(SlotsOf({"left_knee"}, UnitreeBusConfig::G1, {{"left_knee", 35}}), UnitreeError);
  EXPECT_THROW(SlotsOf({"left_knee"}, UnitreeBusConfig::G1, {{"tail", 1}}), UnitreeError);
  EXPECT_THROW(SlotsOf({"left_knee", "right_knee"}, UnitreeBusConfig::G1, {{"left_knee", 9}}),
               UnitreeError);
  EXPECT_THROW(SlotsOf({"waist_roll_joint"}, UnitreeBusConfig::G1_23_OLD), UnitreeError);
}

// unitree_sdk2's gamepad: a head of two bytes, then the buttons, R1 in the lowest bit.
TEST(Remote, ReadsButtons) {
  std::array<uint8_t, 40> bytes{};
  bytes[2] = 0x08;
  EXPECT_EQ(Buttons(bytes), ButtonsOf({"select"}));
  bytes[2] = 0x20;
  bytes[3] = 0x02;
  EXPECT_EQ(Buttons(bytes), ButtonsOf({"L2", "B"}));
  SetButtons(ButtonsOf({"left", "R1"}), bytes);
  EXPECT_EQ(bytes[2], 0x01);
  EXPECT_EQ(bytes[3], 0x80);
  EXPECT_THROW(ButtonsOf({"Z"}), UnitreeError);
}

TEST(MotionSwitcher, ReadsItsAnswersAndNothingElse) {
  EXPECT_EQ(ModeOf(R"({"form":"0","name":"ai"})"), "ai");
  EXPECT_EQ(ModeOf(R"({"form":"","name":""})"), "");
  for (const char* broken : {"", "[]", "{", "null", R"({"name":3})", R"({"form":"0"})"}) {
    EXPECT_EQ(ModeOf(broken), std::nullopt) << broken;
  }
}

}  // namespace
}  // namespace poise::unitree
