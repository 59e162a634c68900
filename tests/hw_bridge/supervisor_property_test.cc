// Whatever arrives, what leaves is finite, limited, and zero for good after a stop.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/hw_bridge/supervisor_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

class Hostile {
 public:
  explicit Hostile(uint64_t seed) : random_(TestSeed(static_cast<uint32_t>(seed))) {}

  int Choose(int n) { return static_cast<int>(random_() % static_cast<uint64_t>(n)); }
  bool Rarely(int n) { return Choose(n) == 0; }

  double Real() {
    switch (Choose(9)) {
      case 0:
        return kNan;
      case 1:
        return kInfinity;
      case 2:
        return -kInfinity;
      case 3:
        return std::numeric_limits<double>::max();
      case 4:
        return std::numeric_limits<double>::denorm_min();
      case 5:
        return std::bit_cast<double>(random_());
      case 6:
        return -1e9;
      default:
        return std::uniform_real_distribution<double>(-300, 300)(random_);
    }
  }
  int64_t Integer(int64_t near) {
    switch (Choose(5)) {
      case 0:
        return std::numeric_limits<int64_t>::max();
      case 1:
        return std::numeric_limits<int64_t>::min();
      case 2:
        return static_cast<int64_t>(random_());
      default:
        return near + Choose(9) - 4;
    }
  }
  double Tame() { return std::uniform_real_distribution<double>(-300, 300)(random_); }

  drive_feedback_t MakeFeedback() {
    drive_feedback_t feedback = Feedback();
    for (size_t j = 0; j < kJoints; ++j) {
      feedback.position_counts[j] = Rarely(20) ? Integer(0) : Choose(200000);
      if (Rarely(60)) feedback.current[j] = Real();
      if (Rarely(60)) feedback.velocity[j] = Real();
      if (Rarely(60)) feedback.drive_status[j] = static_cast<int32_t>(Integer(1));
    }
    if (Rarely(60)) feedback.imu_acceleration[Choose(3)] = Real();
    if (Rarely(60)) feedback.foot_wrench[static_cast<size_t>(Choose(2))].force[Choose(3)] = Real();
    if (Rarely(100)) feedback.position_counts.resize(static_cast<size_t>(Choose(6)));
    if (Rarely(100)) feedback.velocity.resize(static_cast<size_t>(Choose(6)));
    if (Rarely(100)) feedback.drive_status.resize(static_cast<size_t>(Choose(6)));
    return feedback;
  }

  joint_command_t MakeCommand(int64_t cycle) {
    joint_command_t command = Command(cycle, 0);
    for (double& torque : command.torque) torque = Rarely(12) ? Real() : Tame();
    if (Rarely(6)) command.tick = Integer(cycle);
    if (Rarely(12)) command.run_id = Integer(kRun);
    if (Rarely(12)) command.torque.resize(static_cast<size_t>(Choose(6)), 1.0);
    if (Rarely(20)) command.num_joints = static_cast<int32_t>(Integer(kJoints));
    return command;
  }

 private:
  std::mt19937_64 random_;
};

TEST(SupervisorProperty, NoSequenceOfMessagesEverMakesABadCurrent) {
  int64_t running_cycles = 0, stopped_sequences = 0;
  for (uint64_t sequence = 0; sequence < 100000; ++sequence) {
    Hostile hostile(sequence);
    Bench bench;
    const int64_t stop_at = hostile.Choose(80);  // half of the sequences have an emergency stop
    bool stopped_for_good = false, was_free = false;
    int64_t saturations = 0;
    for (int64_t cycle = 0; cycle < 40; ++cycle) {
      if (!hostile.Rarely(10)) bench.supervisor().Read(hostile.MakeFeedback());
      if (cycle == stop_at) bench.supervisor().EmergencyStop();
      if (hostile.Rarely(4)) {
        bench.End(nullptr);
      } else {
        const joint_command_t command = hostile.MakeCommand(cycle);
        bench.End(&command);
      }
      const bridge_status_t& status = bench.status();
      bool free = true;
      for (size_t j = 0; j < kJoints; ++j) {
        const double current = bench.drives().current[j];
        const int8_t enabled = bench.drives().enabled[j];
        ASSERT_TRUE(std::isfinite(current)) << "sequence " << sequence << " cycle " << cycle;
        ASSERT_LE(std::abs(current), kCurrentLimit[j] * (1 + 1e-12)) << sequence;
        ASSERT_TRUE(enabled == 1 || (enabled == 0 && current == 0)) << sequence;
        ASSERT_TRUE(std::isfinite(status.applied_torque[j])) << sequence;
        free = free && enabled == 0;
      }
      // Latched states do not end; a stopped motor does not start.
      if (stopped_for_good) {
        ASSERT_GE(status.state, bridge_status_t::STATE_STOPPING) << sequence;
        if (was_free) {
          ASSERT_TRUE(free) << sequence;
        }
      }
      if (cycle >= stop_at) {
        ASSERT_EQ(status.state, bridge_status_t::STATE_ESTOP) << sequence;
        ASSERT_EQ(status.saturations, saturations) << sequence;  // no command is followed any more
      }
      saturations = status.saturations;
      stopped_for_good = status.state >= bridge_status_t::STATE_STOPPING;
      was_free = stopped_for_good && free;
      running_cycles += status.state == bridge_status_t::STATE_RUNNING;
    }
    stopped_sequences += stopped_for_good;
  }
  // The sequences are hostile, not merely dead: both outcomes are common.
  EXPECT_GT(running_cycles, 100000);
  EXPECT_GT(stopped_sequences, 10000);
}

TEST(SupervisorProperty, AfterTheRampOfAnEmergencyStopNoMotorIsEverEnabled) {
  for (uint64_t sequence = 0; sequence < 1000; ++sequence) {
    Hostile hostile(sequence);
    Bench bench;
    bench.Run(10, 10, 1);
    bench.supervisor().EmergencyStop();
    const int64_t ramp_end = bench.cycle() + 50;
    for (int i = 0; i < 300; ++i) {
      bench.supervisor().Read(hostile.MakeFeedback());
      const joint_command_t command = hostile.MakeCommand(bench.cycle());
      const bool ramp_over = bench.cycle() >= ramp_end;
      bench.End(&command);
      ASSERT_EQ(bench.status().state, bridge_status_t::STATE_ESTOP);
      if (ramp_over) {
        ASSERT_TRUE(bench.AllFree()) << sequence;
      }
    }
  }
}

}  // namespace
}  // namespace poise
