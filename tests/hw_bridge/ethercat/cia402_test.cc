// The drive's state machine, both sides, and the numbers between drive and joint.
#include "hw_bridge/ethercat/cia402.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "hw_bridge/ethercat/drive_scale.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"
#include "tests/test_seed.h"

namespace poise::ethercat {
namespace {

// IEC 61800-7-201, table of the statusword: x is any.
TEST(Cia402, DecodesEveryStatuswordAsTheStandardsTable) {
  struct Row {
    const char* bits;  // 15 to 0
    DriveState state;
  };
  const Row rows[] = {
      {"xxxxxxxxx0xx0000", DriveState::kNotReadyToSwitchOn},
      {"xxxxxxxxx1xx0000", DriveState::kSwitchOnDisabled},
      {"xxxxxxxxx01x0001", DriveState::kReadyToSwitchOn},
      {"xxxxxxxxx01x0011", DriveState::kSwitchedOn},
      {"xxxxxxxxx01x0111", DriveState::kOperationEnabled},
      {"xxxxxxxxx00x0111", DriveState::kQuickStopActive},
      {"xxxxxxxxx0xx1111", DriveState::kFaultReactionActive},
      {"xxxxxxxxx0xx1000", DriveState::kFault},
  };
  for (int word = 0; word <= 0xFFFF; ++word) {
    DriveState expected = DriveState::kUnknown;
    for (const Row& row : rows) {
      bool fits = true;
      for (int bit = 0; bit < 16; ++bit) {
        const char wanted = row.bits[15 - bit];
        fits = fits && (wanted == 'x' || (wanted == '1') == ((word >> bit & 1) != 0));
      }
      if (fits) expected = row.state;
    }
    ASSERT_EQ(DecodeState(static_cast<uint16_t>(word)), expected) << std::hex << word;
  }
}

TEST(Cia402, EncodesWhatItDecodes) {
  for (int i = 1; i < kNumDriveStates; ++i) {
    const auto state = static_cast<DriveState>(i);
    EXPECT_EQ(DecodeState(EncodeState(state)), state);
  }
}

/// A drive on its own, its objects written as the process data would.
class Cia402Drive : public ::testing::Test {
 protected:
  Cia402Drive() : drive_(config_, &objects_, &load_) {
    Set(object::kModeOfOperation, kModeCyclicTorque);
    Run(5);
  }
  void Set(uint16_t index, int value) {
    objects_.Find({index, 0})->value = static_cast<uint32_t>(value);
  }
  uint32_t Value(uint16_t index) { return objects_.Find({index, 0})->value; }
  /// In steps of 0.1 ms.
  void Run(double milliseconds) {
    for (int i = 0; i < std::lround(milliseconds * 10); ++i) {
      now_ += kMillisecond / 10;
      drive_.AdvanceTo(now_, outputs_valid_);
    }
  }
  DriveState Control(uint16_t word) {
    Set(object::kControlword, word);
    Run(5);
    return drive_.state();
  }
  void Enable() {
    Control(kControlShutdown);
    Control(kControlSwitchOn);
    ASSERT_EQ(Control(kControlEnable), DriveState::kOperationEnabled);
  }

  EmulatedDriveConfig config_;
  ObjectDictionary objects_;
  TestLoad load_;
  EmulatedDrive drive_;
  int64_t now_ = 0;
  bool outputs_valid_ = true;
};

TEST_F(Cia402Drive, WalksUpAndDown) {
  EXPECT_EQ(drive_.state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(Control(kControlEnable), DriveState::kSwitchOnDisabled);  // no short cut
  EXPECT_EQ(Control(kControlShutdown), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(Control(kControlSwitchOn), DriveState::kSwitchedOn);
  EXPECT_EQ(Control(kControlEnable), DriveState::kOperationEnabled);
  EXPECT_EQ(Control(kControlSwitchOn), DriveState::kSwitchedOn);  // disable operation
  EXPECT_EQ(Control(kControlEnable), DriveState::kOperationEnabled);
  EXPECT_EQ(Control(kControlShutdown), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(Control(kControlDisableVoltage), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(DecodeState(static_cast<uint16_t>(Value(object::kStatusword))),
            DriveState::kSwitchOnDisabled);
}

TEST_F(Cia402Drive, TransitionsTakeTheirTime) {
  Control(kControlShutdown);
  Set(object::kControlword, kControlSwitchOn);
  Run(1.9);
  EXPECT_EQ(drive_.state(), DriveState::kReadyToSwitchOn);
  Run(0.3);
  EXPECT_EQ(drive_.state(), DriveState::kSwitchedOn);
}

TEST_F(Cia402Drive, QuickStopDropsTheTorqueAndEndsDisabled) {
  Enable();
  Set(object::kMaxTorque, 2000);
  Set(object::kTargetTorque, 500);
  Run(5);
  EXPECT_NEAR(load_.torque_, 0.5 * 1.5, 1e-9);
  Set(object::kControlword, kControlQuickStop);
  Run(0.1);
  EXPECT_EQ(drive_.state(), DriveState::kQuickStopActive);
  EXPECT_EQ(load_.torque_, 0);
  Run(5);
  EXPECT_EQ(drive_.state(), DriveState::kSwitchOnDisabled);
}

TEST_F(Cia402Drive, FaultIsResetByARisingEdgeAlone) {
  Enable();
  Set(object::kMaxTorque, 2000);
  Set(object::kTargetTorque, 500);
  // Held high from before the fault: no edge.
  Set(object::kControlword, kControlEnable | kControlFaultReset);
  Run(5);
  drive_.TriggerFault(kErrorOverCurrent);
  EXPECT_EQ(drive_.state(), DriveState::kFaultReactionActive);
  Run(0.1);
  EXPECT_EQ(load_.torque_, 0);
  Run(5);
  EXPECT_EQ(drive_.state(), DriveState::kFault);
  EXPECT_EQ(Value(object::kErrorCode), kErrorOverCurrent);
  EXPECT_EQ(drive_.TakeEmergency(), kErrorOverCurrent);
  EXPECT_EQ(Control(kControlEnable), DriveState::kFault);
  EXPECT_EQ(Control(kControlFaultReset), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(Value(object::kErrorCode), 0U);
}

TEST_F(Cia402Drive, TorqueIsZeroWithoutPermissionAndWithinTheLimitsWithIt) {
  Enable();
  Set(object::kMaxTorque, 0);  // at power-on the drive's own peak
  Set(object::kTargetTorque, 3000);
  Run(5);
  EXPECT_EQ(load_.torque_, 0);
  Set(object::kMaxTorque, 800);
  Run(5);
  EXPECT_NEAR(load_.torque_, 0.8 * 1.5, 1e-9);
  EXPECT_NE(Value(object::kStatusword) & kStatusInternalLimit, 0U);
  Set(object::kMaxTorque, 60000);
  Set(object::kTargetTorque, -32768);
  Run(5);
  EXPECT_NEAR(load_.torque_, -2.0 * 1.5, 1e-9);  // its own peak
}

TEST_F(Cia402Drive, TorqueSlewsAndTheTorqueActualValueShowsIt) {
  Enable();
  Set(object::kMaxTorque, 2000);
  Set(object::kTargetTorque, 1500);
  Run(0.1);
  EXPECT_NEAR(load_.torque_, 0.3 * 1.5, 1e-9);  // 3000 per mille a ms
  EXPECT_EQ(Value(object::kTorque), 300U);
  Run(0.4);
  EXPECT_NEAR(load_.torque_, 1.5 * 1.5, 1e-9);
}

// From the rated torque's balance: (2² - 1) for peak_time seconds fills the budget.
TEST_F(Cia402Drive, HeatLimitsToTheRatedTorqueAfterThePeakTime) {
  Enable();
  Set(object::kMaxTorque, 2000);
  Set(object::kTargetTorque, 2000);
  Run(2990);
  EXPECT_NEAR(load_.torque_, 2.0 * 1.5, 1e-9);
  Run(30);
  EXPECT_NEAR(load_.torque_, 1.0 * 1.5, 1e-9);
}

TEST_F(Cia402Drive, StoTakesTheTorqueAndHoldsTheDriveDisabled) {
  Enable();
  Set(object::kMaxTorque, 2000);
  Set(object::kTargetTorque, 500);
  Run(5);
  drive_.SetSto(true);
  Run(0.1);
  EXPECT_EQ(load_.torque_, 0);
  EXPECT_EQ(drive_.state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(Value(object::kStatusword) & kStatusVoltageEnabled, 0U);
  EXPECT_EQ(Control(kControlShutdown), DriveState::kSwitchOnDisabled);
  drive_.SetSto(false);
  EXPECT_EQ(Control(kControlShutdown), DriveState::kReadyToSwitchOn);
}

TEST_F(Cia402Drive, LosingTheOutputsIsAFault) {
  Enable();
  outputs_valid_ = false;
  Run(0.1);
  EXPECT_EQ(load_.torque_, 0);
  Run(5);
  EXPECT_EQ(drive_.state(), DriveState::kFault);
  EXPECT_EQ(Value(object::kErrorCode), kErrorCommunication);
}

TEST_F(Cia402Drive, AnotherModeIsNotTakenAndGivesNoTorque) {
  EmulatedDriveConfig config;
  ObjectDictionary objects;
  EmulatedDrive drive(config, &objects, &load_);
  objects.Find({object::kModeOfOperation, 0})->value = 8;
  drive.AdvanceTo(5 * kMillisecond, true);
  EXPECT_EQ(objects.Find({object::kModeDisplay, 0})->value, 0U);
}

TEST_F(Cia402Drive, PositionCountsAndWrapsAround) {
  // Half a turn before the wrap-around of 2^31 counts of 8192 a turn.
  const double turns = 2147483648.0 / 8192;
  load_.position_ = (turns - 0.5) * 2 * std::numbers::pi + 1e-9;
  Run(0.1);
  EXPECT_EQ(static_cast<int32_t>(Value(object::kPosition)), 2147483647 - 4095);
  load_.position_ = (turns + 0.5) * 2 * std::numbers::pi + 1e-9;
  Run(0.1);
  EXPECT_EQ(static_cast<int32_t>(Value(object::kPosition)), -2147483647 - 1 + 4096);
  drive_.FreezeEncoder(true);
  load_.position_ = 0;
  Run(0.1);
  EXPECT_EQ(static_cast<int32_t>(Value(object::kPosition)), -2147483647 - 1 + 4096);
}

// The master's control against the drive: every goal is reached from every state.
TEST_F(Cia402Drive, ControlReachesEveryGoal) {
  DriveControl control;
  const auto lead = [&](DriveGoal goal) {
    for (int i = 0; i < 20; ++i) {
      Set(object::kControlword,
          control.Controlword(DecodeState(static_cast<uint16_t>(Value(object::kStatusword))),
                              goal));
      Run(2);
    }
    return drive_.state();
  };
  EXPECT_EQ(lead(DriveGoal::kEnabled), DriveState::kOperationEnabled);
  EXPECT_EQ(lead(DriveGoal::kQuickStop), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(lead(DriveGoal::kEnabled), DriveState::kOperationEnabled);
  drive_.TriggerFault(kErrorOverCurrent);
  EXPECT_EQ(lead(DriveGoal::kEnabled), DriveState::kFault);  // not by itself
  control.RequestFaultReset();
  EXPECT_EQ(lead(DriveGoal::kEnabled), DriveState::kOperationEnabled);
  EXPECT_FALSE(control.resetting());
  EXPECT_EQ(lead(DriveGoal::kDisabled), DriveState::kSwitchOnDisabled);
}

robot::MotorModel PaperMotor() {
  robot::MotorModel motor;
  motor.gear_ratio = 50;
  motor.torque_constant = 0.10;
  motor.rated_current = 15;
  motor.peak_current = 30;
  motor.encoder_counts = 8192;
  return motor;
}

TEST(DriveScale, ConvertsAsEquation54) {
  DriveConfig config;
  config.set_joint("j");
  config.set_rated_torque(1500);
  config.set_rated_current(15000);
  const DriveScale scale(PaperMotor(), config);
  // Rated current gives rated torque: 1000 per mille, 75 N·m at the joint.
  EXPECT_EQ(scale.TorquePerMille(15), 1000);
  EXPECT_DOUBLE_EQ(scale.Current(1000), 15);
  EXPECT_EQ(scale.LimitPerMille(30), 2000);
  EXPECT_EQ(scale.TorquePerMille(0.0074), 0);
  EXPECT_EQ(scale.TorquePerMille(0.0076), 1);
  EXPECT_EQ(scale.TorquePerMille(1e9), 32767);
  EXPECT_EQ(scale.TorquePerMille(-1e9), -32767);

  config.set_reversed(true);
  config.set_zero_counts(1000);
  const DriveScale reversed(PaperMotor(), config);
  EXPECT_EQ(reversed.TorquePerMille(15), -1000);
  EXPECT_DOUBLE_EQ(reversed.Current(-1000), 15);
  EXPECT_EQ(reversed.LimitPerMille(30), 2000);
  EXPECT_EQ(reversed.JointCounts(1000), 0);
  // One turn of the motor is 1/50 turn of the joint, the other way.
  EXPECT_DOUBLE_EQ(JointPositionOf(PaperMotor(), reversed.JointCounts(1000 + 8192)),
                   -2 * std::numbers::pi / 50);
}

TEST(CounterUnwrap, FollowsTheTrueCountThroughWrapArounds) {
  std::mt19937_64 random(TestSeed(1));
  std::uniform_int_distribution<int64_t> step(-2147483647, 2147483647);
  int64_t truth = 12345;
  CounterUnwrap unwrap;
  for (int i = 0; i < 100'000; ++i) {
    ASSERT_EQ(unwrap.Update(static_cast<int32_t>(static_cast<uint64_t>(truth))), truth);
    truth += step(random);
  }
  CounterUnwrap edge;
  EXPECT_EQ(edge.Update(2147483647), 2147483647);
  EXPECT_EQ(edge.Update(-2147483647 - 1), 2147483648);
  EXPECT_EQ(edge.Update(2147483647), 2147483647);
}

}  // namespace
}  // namespace poise::ethercat
