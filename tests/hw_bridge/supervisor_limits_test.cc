// Limits and trips of the supervisor: start, slew, heat, ranges, tilt, sensors, bus, time, reset.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/hw_bridge/supervisor_fixture.h"

namespace poise {
namespace {

using Status = bridge_status_t;

constexpr double kGravity = 9.80665;

TEST(SupervisorStart, WaitsForJointsInTheirRangeAndAtRest) {
  SupervisorConfig config = ThreeJoints();
  config.lower.assign(kJoints, -0.5);
  config.upper.assign(kJoints, 0.5);
  config.start_velocity = 0.5;
  Bench bench(config);
  bench.Step(nullptr, 0.6 / 0.002);  // to 0.6 rad
  for (int i = 0; i < 20; ++i) {
    bench.Step(10.0);
    ASSERT_EQ(bench.status().state, Status::STATE_INIT);
    ASSERT_EQ(bench.status().reason, Status::REASON_START_POSITION);
    ASSERT_EQ(bench.status().reason_joint, 0);
    ASSERT_TRUE(bench.AllFree());
  }
  for (int i = 0; i < 50; ++i) bench.Step(10.0, -3);  // back to 0.3 rad
  EXPECT_EQ(bench.status().reason, Status::REASON_START_VELOCITY);
  EXPECT_TRUE(bench.AllFree());
  for (int i = 0; i < 10; ++i) bench.Step(10.0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
}

TEST(SupervisorStart, FadesTheFirstCommandIn) {
  SupervisorConfig config = ThreeJoints();
  config.settings.set_first_command_ramp(9 * config.period);
  Bench bench(config);
  for (int i = 1; i <= 12; ++i) {
    bench.Step(50.0);
    EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], 50 * std::min(1.0, i / 10.0)) << i;
  }
}

TEST(SupervisorLimits, SlewIsLimited) {
  SupervisorConfig config = ThreeJoints();
  config.thresholds.slew_limit = 5000;  // 10 N·m in a cycle
  Bench bench(config);
  bench.Run(5, 20, 0);
  bench.Step(50.0);
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], 30);
  EXPECT_EQ(bench.status().saturated[0], Status::LIMIT_SLEW);
  bench.Step(50.0);
  EXPECT_EQ(bench.status().saturated[0], Status::LIMIT_SLEW);
  bench.Step(50.0);
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], 50);
  EXPECT_EQ(bench.status().saturated[0], 0);
}

// At twice the rated current the budget (2² − 1)·t lasts t; the limit then falls to the rating.
TEST(SupervisorLimits, HeatHoldsTheCurrentToTheRating) {
  SupervisorConfig config = ThreeJoints();
  for (robot::MotorModel& motor : config.motors) motor.rated_current = motor.peak_current / 2;
  config.torque_limit.assign(kJoints, 1e6);
  Bench bench(config);
  int at_peak = 0;
  double squares = 0;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    bench.Step(1000.0);
    const double share = bench.drives().current[1] / 30;
    ASSERT_LE(share, 1 + 1e-12);
    at_peak += share > 0.999 ? 1 : 0;
    squares += 4 * share * share - 1;
  }
  EXPECT_NEAR(at_peak * 0.002, 2, 0.11);      // all but the soft time
  EXPECT_NEAR(squares * 0.002, 3 * 2, 0.05);  // the budget, and no more
  EXPECT_NEAR(bench.drives().current[1], 15, 0.1);
  EXPECT_NEAR(bench.status().thermal_load[1], 1, 1e-3);
  EXPECT_NE(bench.status().saturated[1] & Status::LIMIT_THERMAL, 0);
  // Without current it cools: (0 − 1)/budget per s.
  bench.Run(500, 0, 0);
  EXPECT_NEAR(bench.status().thermal_load[1], 1 - 1.0 / 6, 1e-3);
}

SupervisorConfig Ranged() {
  SupervisorConfig config = ThreeJoints();
  config.lower.assign(kJoints, -0.5);
  config.upper.assign(kJoints, 0.5);
  config.soft_range = 0.1;
  return config;
}

TEST(SupervisorLimits, TorqueTowardsALimitFadesOut) {
  Bench bench(Ranged());
  bench.Run(5, 20, 0);
  bench.Run(460, 20, 0.5);  // to 0.46 rad, 0.04 before the limit
  EXPECT_NEAR(bench.status().applied_torque[0], 20 * 0.4, 0.02);
  EXPECT_EQ(bench.status().saturated[0], Status::LIMIT_POSITION);
  bench.Step(-20.0, 0);  // away from it
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], -20);
}

TEST(SupervisorTrips, BeyondTheRange) {
  Bench bench(Ranged());
  bench.Run(5, 0, 0);
  while (bench.status().state == Status::STATE_RUNNING && bench.cycle() < 1000)
    bench.Step(0.0, -1.01);
  EXPECT_EQ(bench.status().reason, Status::REASON_JOINT_POSITION);
  EXPECT_EQ(bench.status().reason_joint, 0);
  EXPECT_EQ(bench.cycle(), 5 + 273);  // the first of 2.02 mrad steps beyond −0.55
}

TEST(SupervisorTrips, TooFast) {
  SupervisorConfig config = ThreeJoints();
  config.velocity_limit = {9, 2, 9};
  config.settings.set_velocity_trip(1.5);
  Bench bench(config);
  bench.Run(500, 0, 2.9);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  bench.Run(500, 0, 3.1);
  EXPECT_EQ(bench.status().reason, Status::REASON_JOINT_VELOCITY);
  EXPECT_EQ(bench.status().reason_joint, 1);
}

// A joint that goes at v > v_trip from rest has a mean speed of v (1 − exp(−t / T)).
TEST(SupervisorTrips, ABlowIsOverBeforeItsMeanSpeedIsTooFast) {
  SupervisorConfig config = ThreeJoints();
  config.velocity_limit = {9, 2, 9};
  config.settings.set_velocity_trip(1.5);
  for (const double speed : {3.5, 6.0, 9.0}) {
    const double trips_after = 0.1 * std::log(speed / (speed - 3));
    const auto run = [&](double time) {
      Bench bench(config);
      bench.Run(50, 0, 0);
      bench.Run(static_cast<int>(std::lround(time / config.period)), 0, speed);
      bench.Run(50, 0, 0);
      return bench.status().state;
    };
    EXPECT_EQ(run(trips_after - 0.008), Status::STATE_RUNNING) << speed;
    EXPECT_NE(run(trips_after + 0.012), Status::STATE_RUNNING) << speed;
  }
}

TEST(SupervisorLimits, NoTorqueMakesAJointFasterThanAnyControlledMotion) {
  SupervisorConfig config = ThreeJoints();
  config.velocity_limit = {9, 2, 9};
  config.settings.set_velocity_trip(1.5);
  const auto applied = [&](double torque, double speed) {
    Bench bench(config);
    bench.Run(20, torque, 0);
    bench.Run(15, torque, speed);  // the filter of the velocity has settled
    EXPECT_EQ(bench.status().state, Status::STATE_RUNNING) << speed;
    const double given = bench.status().applied_torque[1];
    EXPECT_EQ(bench.status().saturated[1], given == torque ? 0 : Status::LIMIT_VELOCITY);
    return given;
  };
  for (const double way : {-1.0, 1.0}) {
    EXPECT_EQ(applied(way * 20, way * 1.9), way * 20);
    EXPECT_NEAR(applied(way * 20, way * 2.5), way * 10, 0.1);
    EXPECT_EQ(applied(way * 20, way * 3.2), 0);
    EXPECT_EQ(applied(-way * 20, way * 3.2), -way * 20) << "it brakes";
  }
}

/// The readings of a body that tips about y at `rate` for `cycles`, then stays.
int CyclesToTilt(double rate, double limit, double* tilt) {
  SupervisorConfig config = ThreeJoints();
  config.settings.set_tilt_limit(limit);
  Bench bench(config);
  *tilt = 0;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    drive_feedback_t& feedback = bench.feedback();
    feedback.imu_acceleration[0] = -kGravity * std::sin(*tilt);
    feedback.imu_acceleration[2] = kGravity * std::cos(*tilt);
    feedback.imu_angular_velocity[1] = cycle < 10 ? 0 : rate;
    bench.Step(0.0);
    if (bench.status().reason == Status::REASON_BODY_TILT) return cycle;
    if (cycle >= 10) *tilt += rate * 0.002;
  }
  return -1;
}

TEST(SupervisorTrips, TiltedBody) {
  double tilt = 0;
  EXPECT_GT(CyclesToTilt(1, 0.7, &tilt), 0);
  EXPECT_NEAR(tilt, 0.7, 0.01);
  EXPECT_GT(CyclesToTilt(-0.05, 0.2, &tilt), 0);
  EXPECT_NEAR(tilt, -0.2, 0.01);
}

// The accelerometer corrects the gyro's drift: 0.02 rad/s of bias stay 0.02 rad with 1 s.
TEST(SupervisorTrips, GyroBiasIsNoTilt) {
  SupervisorConfig config = ThreeJoints();
  config.settings.set_tilt_limit(0.03);
  Bench bench(config);
  bench.feedback().imu_acceleration[2] = kGravity;
  bench.feedback().imu_angular_velocity[0] = 0.02;
  bench.Run(30000, 0, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
}

TEST(SupervisorTrips, AnEncoderThatStandsStillWhileTorqueChangesIsFrozen) {
  SupervisorConfig config = ThreeJoints();
  config.thresholds.frozen_torque = 20;
  Bench bench(config);
  bench.Run(200, 10, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);  // a joint that stands still
  bench.Run(100, 29, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);  // 19 N·m more
  bench.Run(60, 31, 0.01);                                 // every joint moves
  bench.Run(200, 20, 0);
  ASSERT_EQ(bench.status().state, Status::STATE_RUNNING);
  // A step in the torque of a joint that stands still has not moved it yet.
  bench.Run(9, 41, 0);
  ASSERT_EQ(bench.status().state, Status::STATE_RUNNING);
  bench.Run(3, 41, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
  EXPECT_EQ(bench.status().reason, Status::REASON_ENCODER_FROZEN);
}

// OP3 stands so still that the step in its knees' torque with which a walk begins comes after more
// than 0.1 s without a count; two cycles later they move.
TEST(SupervisorTrips, AJointThatAStepInItsTorqueMovesIsNotFrozen) {
  SupervisorConfig config = ThreeJoints();
  config.thresholds.frozen_torque = 20;
  Bench bench(config);
  bench.Run(200, 10, 0);
  bench.Run(2, 35, 0);
  bench.Run(60, 35, 0.01);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
}

// Readings that are a cycle old, while the torque goes up and down in every cycle.
TEST(SupervisorTrips, AnOldReadingOfATorqueThatChangesIsPlausible) {
  for (const int cycles : {1, 3}) {
    SupervisorConfig config = ThreeJoints();
    config.thresholds.torque_error = 15;
    config.current_cycles = cycles;
    Bench bench(config);
    double old = 0, last = 0;
    for (int i = 0; i < 40; ++i) {
      for (size_t j = 0; j < kJoints; ++j) {
        bench.feedback().current[j] = MotorCurrent(config.motors[j], old);
      }
      old = last;
      last = i % 2 == 0 ? 10 : -10;
      bench.Run(1, last, 0.01);
    }
    EXPECT_EQ(bench.status().state == Status::STATE_RUNNING, cycles == 3);
  }
}

TEST(SupervisorTrips, ATorqueThatIsNotTheCommandedOneForTenCycles) {
  SupervisorConfig config = ThreeJoints();
  config.thresholds.torque_error = 15;
  Bench bench(config);
  const auto follow = [&](double torque) {
    for (size_t j = 0; j < kJoints; ++j) {
      bench.feedback().current[j] = MotorCurrent(config.motors[j], torque);
    }
  };
  follow(18);
  bench.Run(100, 18, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  bench.feedback().current[2] = 0;
  bench.Run(9, 18, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  follow(18);
  bench.Run(1, 18, 0);
  bench.feedback().current[2] = 0;
  bench.Run(9, 18, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);  // not ten in a row
  bench.Run(1, 18, 0);
  EXPECT_EQ(bench.status().reason, Status::REASON_TORQUE_IMPLAUSIBLE);
  EXPECT_EQ(bench.status().reason_joint, 2);
}

TEST(SupervisorTrips, ABusThatIsNoLongerUsable) {
  for (const bool lost : {false, true}) {
    Bench bench;
    bench.Run(10, 10, 0);
    BusHealth health;
    health.usable = false;
    health.link_lost = lost;
    health.frames_lost = 5;
    bench.supervisor().ReadBus(health);
    bench.Step(10.0);
    EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
    EXPECT_EQ(bench.status().reason, lost ? Status::REASON_BUS_LINK : Status::REASON_BUS_INPUTS);
    EXPECT_EQ(bench.status().bus_usable, 0);
    EXPECT_EQ(bench.status().frames_lost, 5);
  }
}

TEST(SupervisorTrips, OverrunsInARowOrOfAHundred) {
  SupervisorConfig config = ThreeJoints();
  config.overrun_lateness = 0.5;  // of 2 ms
  config.overruns_in_a_row = 5;
  config.overruns_in_100 = 20;
  for (const int every : {1, 4, 6}) {
    Bench bench(config);
    int cycles = 0;
    for (; cycles < 1000 && bench.status().state <= Status::STATE_RUNNING; ++cycles) {
      bench.supervisor().CountLateness(cycles % every == 0 ? 0.0011 : 0.0009);
      bench.Step(10.0);
    }
    EXPECT_EQ(cycles, every == 1 ? 5 : every == 4 ? 77 : 1000);  // the twentieth is cycle 76
    EXPECT_EQ(bench.status().overruns, every == 1 ? 5 : every == 4 ? 20 : 167);
    if (every < 6) {
      EXPECT_EQ(bench.status().reason, Status::REASON_CYCLE_OVERRUN);
    }
  }
}

TEST(SupervisorReset, EndsAStopThatIsOverIfNoTorqueIsCommanded) {
  Bench bench;
  bench.Run(20, 10, 0);
  bench.supervisor().EmergencyStop(Status::REASON_SIGNAL);
  bench.Step(10.0);
  EXPECT_EQ(bench.status().reason, Status::REASON_SIGNAL);
  bench.supervisor().RequestReset();  // while it ramps out
  bench.Step(0.0);
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  bench.Run(60, 0, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  bench.supervisor().RequestReset();
  bench.Step(10.0);  // torque is commanded
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  EXPECT_FALSE(bench.supervisor().TakeReset());
  bench.Step(0.0);  // the request was used up
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  bench.supervisor().RequestReset();
  bench.Step(0.0);
  EXPECT_EQ(bench.status().state, Status::STATE_INIT);
  EXPECT_EQ(bench.status().resets, 1);
  EXPECT_TRUE(bench.supervisor().TakeReset());
  EXPECT_FALSE(bench.supervisor().TakeReset());
  EXPECT_TRUE(bench.AllFree());
  for (int i = 0; i < 3; ++i) bench.Step(10.0);  // enable_cycles pass for the drives' reset
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
}

TEST(SupervisorReset, AFaultThatStaysStopsAgain) {
  Bench bench;
  bench.Run(20, 10, 0);
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_FAULT;
  bench.Run(60, 0, 0);
  ASSERT_EQ(bench.status().state, Status::STATE_STOPPED);
  bench.supervisor().RequestReset();
  bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_INIT);
  for (int i = 0; i < 5; ++i) bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPED);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_FAULT);
}

TEST(SupervisorStop, SafeTorqueOffIsAnEmergencyStop) {
  Bench bench;
  bench.Run(20, 10, 0);
  std::vector<DriveReport> reports(kJoints, {.state = Status::DRIVE_ENABLED, .sto = false});
  reports[2].sto = true;
  bench.supervisor().Read(bench.Turn(0), reports);
  bench.End(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_STO);
  EXPECT_EQ(bench.status().reason_joint, 2);
  EXPECT_EQ(bench.status().drive_state[0], Status::DRIVE_ENABLED);
  EXPECT_EQ(bench.drives().enabled[2], 0);
}

TEST(SupervisorStop, ShutdownRampsOutWithItsOwnReason) {
  Bench bench;
  bench.Run(100, 10, 1.0);
  bench.supervisor().Shutdown();
  for (int i = 0; i < 50; ++i) {
    ASSERT_FALSE(bench.supervisor().at_rest());
    bench.Step(nullptr, 1.0);
    EXPECT_NEAR(bench.drives().current[0], -4.0 * (50 - i) / 50, 0.03);
  }
  EXPECT_TRUE(bench.supervisor().at_rest());
  EXPECT_EQ(bench.status().reason, Status::REASON_SHUTDOWN);
}

}  // namespace
}  // namespace poise
