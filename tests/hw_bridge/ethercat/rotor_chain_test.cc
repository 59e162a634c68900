// A chain of drives by itself, as `poise drives emulate` has it: rotors instead of a robot.
#include <gtest/gtest.h>

#include "hw_bridge/ethercat/emulator/rotor.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

constexpr double kInertia = 2e-4;  // kg·m²
constexpr double kDamping = 1e-3;  // N·m·s/rad

// J dω = (τ - d ω) dt over any time: J Δω + d Δθ = ∫ τ dt, however it is stepped.
TEST(RotorChain, ARotorsMomentumIsTheImpulse) {
  Rotor rotor(kInertia, kDamping);
  double impulse = 0;
  int64_t now = 0;
  for (int i = 0; i < 200; ++i) {
    const double torque = 0.1 * (i % 7) - 0.2;
    const int64_t step = 100'000 * (1 + i % 5);  // ns
    rotor.SetTorque(torque);
    rotor.AdvanceTo(now += step);
    impulse += torque * 1e-9 * static_cast<double>(step);
  }
  ASSERT_GT(std::abs(impulse), 1e-3);
  EXPECT_NEAR(kInertia * rotor.velocity() + kDamping * rotor.position(), impulse, 1e-12);
  rotor.SetTorque(0.05);
  rotor.AdvanceTo(now + 100 * kSecond);
  EXPECT_NEAR(rotor.velocity(), 0.05 / kDamping, 1e-9);
}

TEST(RotorChain, TurnsUnderAMasterWithoutARobot) {
  const MasterConfig config = MakeMasterConfig(2);
  std::vector<Rotor> rotors(2, {kInertia, kDamping});
  EmulatedChain chain(MakeChainConfig(2), std::vector<MotorLoad*>{&rotors[0], &rotors[1]});
  MemoryLink link(&chain);
  Master master(&link, config);
  master.Start();
  std::vector<DriveControl> controls(2);
  const auto drive = [&](int cycles, int16_t torque) {
    for (int cycle = 0; cycle < cycles; ++cycle) {
      for (size_t i = 0; i < 2; ++i) {
        const DriveState state = DecodeState(master.inputs(i).statusword);
        // The second against the first.
        master.set_outputs(i, {.controlword = controls[i].Controlword(state, DriveGoal::kEnabled),
                               .target_torque = static_cast<int16_t>(i == 0 ? torque : -torque),
                               .max_torque = 1000});
      }
      const int64_t start = link.Now();
      ASSERT_TRUE(master.Send());
      ASSERT_TRUE(master.Receive(start + config.cycle() / 2).complete);
      link.AdvanceTo(start + config.cycle());
    }
  };
  drive(50, 0);
  const int32_t before = master.inputs(0).position;
  drive(20, 100);  // 0.15 N·m of 1.5
  EXPECT_NEAR(rotors[0].torque(), 0.15, 1e-9);
  EXPECT_NEAR(rotors[1].torque(), -0.15, 1e-9);
  const double momentum = kInertia * rotors[0].velocity() + kDamping * rotors[0].position();
  const int64_t from = link.Now();
  drive(50, 100);
  const double impulse = 0.15 * 1e-9 * static_cast<double>(link.Now() - from);
  EXPECT_NEAR(kInertia * rotors[0].velocity() + kDamping * rotors[0].position(), momentum + impulse,
              0.02 * impulse);
  EXPECT_GT(master.inputs(0).position, before);
  EXPECT_LT(master.inputs(1).position, 0);
  EXPECT_TRUE(master.Stop());
}

}  // namespace
}  // namespace poise::ethercat
