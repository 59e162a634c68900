// Distributed clocks: delays, offsets, drift compensation, SYNC0 and the steered cycle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "tests/hw_bridge/ethercat/chain_fixture.h"
#include "tests/test_seed.h"

namespace poise::ethercat {
namespace {

TEST(DistributedClocks, DifferenceRegisterIsSignAndMagnitude) {
  EXPECT_EQ(DcDifference(25), 25);
  EXPECT_EQ(DcDifference(0x80000000U | 25), -25);
}

TEST(DistributedClocks, AllSlavesShowOneTimeAndKeepIt) {
  Bench bench(4);
  std::mt19937_64 random(TestSeed(3));
  for (EmulatedDriveConfig& drive : *bench.chain_config.mutable_drive()) {
    drive.set_clock_error(std::uniform_real_distribution<double>(-50, 50)(random));
    drive.set_clock_start(static_cast<int64_t>(random() % (1LL << 40)));
  }
  bench.master_config.set_drift_frames(2000);
  bench.Start();
  const auto spread = [&] {
    int64_t worst = 0;
    for (size_t i = 1; i < 4; ++i) {
      worst = std::max(worst, std::abs(bench.chain->slave(i).esc().SystemTime() -
                                       bench.chain->slave(0).esc().SystemTime()));
    }
    return worst;
  };
  EXPECT_LT(spread(), 100);  // ns
  for (int i = 0; i < 2000; ++i) bench.Cycle();
  EXPECT_LT(spread(), 100);
  // The slaves' own account of it.
  for (size_t i = 1; i < 4; ++i) {
    const auto value = bench.master->slave(i).Read<uint32_t>(reg::kDcDifference);
    EXPECT_LT(std::abs(DcDifference(value)), 100);
  }
}

TEST(DistributedClocks, MeasuresTheHopBetweenSlaves) {
  Bench bench(3);
  bench.chain_config.set_hop(900);
  bench.Start();
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.master->slave(i).Read<int32_t>(reg::kDcDelay), static_cast<int32_t>(900 * i));
  }
}

TEST(DistributedClocks, OutputsActAtSync0) {
  Bench bench(1);
  bench.Start();
  ASSERT_TRUE(bench.chain->slave(0).esc().sync0_enabled());
  bench.SetTorque(0, 1000);
  // The cycle's start at phase 0 of the slaves' time; SYNC0 half a cycle later.
  const int64_t cycle = bench.master_config.cycle();
  const int64_t phase = bench.chain->slave(0).esc().SystemTime() % cycle;
  bench.link->AdvanceTo(bench.link->Now() + cycle - phase);
  bench.Drive(DriveGoal::kEnabled, 20);
  ASSERT_EQ(bench.State(0), DriveState::kOperationEnabled);
  bench.SetTorque(400, 1000);
  const int64_t start = bench.link->Now();
  static_cast<void>(bench.master->Send());
  bench.link->AdvanceTo(start + cycle / 2 - 50'000);
  EXPECT_EQ(bench.loads[0].torque_, 0);
  for (int64_t t = -50'000; t <= 300'000; t += 10'000) {
    bench.link->AdvanceTo(start + cycle / 2 + t);
  }
  EXPECT_NEAR(bench.loads[0].torque_, 0.4 * 1.5, 1e-9);
}

TEST(DistributedClocks, ASync0CycleOfZeroIsRefused) {
  Bench bench(1);
  bench.Build();
  EmulatedEsc& esc = bench.chain->slave(0).esc();
  bench.master->Start();
  ASSERT_TRUE(bench.master->Stop());
  bench.master->Start();  // from INIT once more
  SlaveAccess& slave = bench.master->slave(0);
  slave.ChangeState(AlState::kPreOp);
  slave.Write<uint32_t>(reg::kDcSync0Cycle, 0);
  ASSERT_EQ(esc.sync0_cycle(), 0U);
  const std::string error = ErrorOf([&] { slave.ChangeState(AlState::kSafeOp); });
  EXPECT_NE(error.find("0x0036 (DC invalid SYNC0 cycle time)"), std::string::npos) << error;
}

// A PC whose clock is off by 80 ppm and whose frames jitter: the phase stays, the jitter's mean
// gone.
TEST(CycleSteering, HoldsThePhaseAgainstAnotherOscillator) {
  constexpr int64_t kCycle = 2'000'000;
  for (const double error : {80e-6, -80e-6}) {
    CycleSteering steering(kCycle);
    std::mt19937_64 random(TestSeed(5));
    std::uniform_real_distribution<double> jitter(-20'000, 20'000);
    double reference = 777'000;  // ns, the slaves' time of this cycle's frame
    double sum = 0;
    double worst = 0;
    for (int i = 0; i < 20'000; ++i) {
      const int64_t correction = steering.Update(static_cast<int64_t>(reference + jitter(random)));
      ASSERT_LE(std::abs(correction), kCycle / 100);
      reference += static_cast<double>(kCycle + correction) * (1 + error);
      const double phase = std::remainder(reference, static_cast<double>(kCycle));
      if (i < 10'000) continue;
      sum += phase;
      worst = std::max(worst, std::abs(phase));
    }
    // The mean phase is the jitter's mean with the other sign: six of its deviations, ns.
    EXPECT_LT(std::abs(sum / 10'000), 6 * 20'000 / std::sqrt(3.0) / std::sqrt(10'000.0));
    EXPECT_LT(worst, 20'000);
  }
}

TEST(CycleSteering, TakesTimesBeforeTheEpoch) {
  CycleSteering steering(2'000'000);
  steering.Update(-2'000'000 - 5);
  EXPECT_EQ(steering.phase_error(), -5);
  steering.Update(INT64_MIN);
  EXPECT_LE(std::abs(steering.phase_error()), 1'000'000);
}

}  // namespace
}  // namespace poise::ethercat
