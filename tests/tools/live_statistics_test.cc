// Rates and ages of a run whose messages come at known times.
#include "tools/live/live_statistics.h"

#include <gtest/gtest.h>

#include "tests/logging/log_test_support.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kStart = 1000 * kSecond;

class LiveStatisticsTest : public ::testing::Test {
 protected:
  /// Ticks [first, last) of the sensors, one each 4 ms from `begin` on.
  void SendTicks(int64_t first, int64_t last, int64_t begin) {
    for (int64_t tick = first; tick < last; ++tick) {
      statistics.AddMessage(sensors, tick, 376, begin + (tick - first) * kSecond / 250);
    }
  }
  ControlClient::Status Health(int64_t tick, int64_t time) const {
    ControlClient::Status status;
    status.seen = true;
    status.last_seen = time;
    status.health.tick = tick;
    status.health.state = health_t::STATE_RUNNING;
    return status;
  }
  const LiveSnapshot::Process& Process(const LiveSnapshot& snapshot, const std::string& name) {
    for (const auto& process : snapshot.processes) {
      if (process.name == name) return process;
    }
    throw std::out_of_range(name);
  }

  RunSpec spec = logging::MakeTestSpec();
  int sensors = logging::ChannelIndex(spec, "ROBOT_SENSORS");
  LiveStatistics statistics{spec, kStart};
};

TEST_F(LiveStatisticsTest, ChannelsAreMeasuredOverTheInterval) {
  SendTicks(0, 250, kStart);
  LiveSnapshot snapshot = statistics.Take(kStart + kSecond);
  const auto row = static_cast<size_t>(sensors);
  EXPECT_EQ(snapshot.channels[row].name, "ROBOT_SENSORS");
  EXPECT_DOUBLE_EQ(snapshot.channels[row].rate, 250);
  EXPECT_DOUBLE_EQ(snapshot.channels[row].bytes_per_second, 250 * 376);
  EXPECT_EQ(snapshot.channels[row].bytes_per_message, 376);
  EXPECT_EQ(snapshot.channels[row].tick, 249);
  EXPECT_NEAR(snapshot.channels[row].age, 0.004, 1e-9);
  EXPECT_EQ(snapshot.tick, 249);
  EXPECT_NEAR(snapshot.tick_rate, 250, 1e-6);

  SendTicks(250, 300, kStart + kSecond);
  snapshot = statistics.Take(kStart + kSecond + kSecond / 2);
  EXPECT_DOUBLE_EQ(snapshot.channels[row].rate, 100);
  EXPECT_NEAR(snapshot.tick_rate, 250, 1e-6);

  snapshot = statistics.Take(kStart + 3 * kSecond);
  EXPECT_DOUBLE_EQ(snapshot.channels[row].rate, 0);
  EXPECT_EQ(snapshot.channels[row].tick, 299);
  EXPECT_NEAR(snapshot.channels[row].age, 3 - 1.196, 1e-9);
}

TEST_F(LiveStatisticsTest, AChannelThatNeverSpokeHasNoAge) {
  const LiveSnapshot snapshot = statistics.Take(kStart + kSecond);
  for (const auto& channel : snapshot.channels) {
    EXPECT_LT(channel.age, 0);
    EXPECT_EQ(channel.tick, -1);
    EXPECT_EQ(channel.rate, 0);
  }
  EXPECT_EQ(snapshot.tick, -1);
  EXPECT_LT(snapshot.tick_rate, 0);
}

TEST_F(LiveStatisticsTest, CountsTheTicksThatItDidNotGet) {
  SendTicks(10, 20, kStart);  // it came late: no loss
  SendTicks(25, 30, kStart);
  SendTicks(28, 31, kStart);  // repeated
  EXPECT_EQ(statistics.Take(kStart + kSecond).channels[static_cast<size_t>(sensors)].missed, 5);
}

TEST_F(LiveStatisticsTest, AnOperatorsMessagesHaveNoTick) {
  const int stop = logging::ChannelIndex(spec, "EMERGENCY_STOP");
  statistics.AddMessage(stop, 0, 33, kStart);
  statistics.AddMessage(stop, 5000, 33, kStart);
  const LiveSnapshot snapshot = statistics.Take(kStart + kSecond);
  EXPECT_EQ(snapshot.channels[static_cast<size_t>(stop)].missed, 0);
  EXPECT_EQ(snapshot.tick, -1);
}

TEST_F(LiveStatisticsTest, TicksOfAnyNumberDoNotOverflow) {
  for (int i = 0; i < 3; ++i) {
    for (const int64_t tick : {INT64_MAX, INT64_MIN, int64_t{0}, int64_t{-1}}) {
      statistics.AddMessage(sensors, tick, 376, kStart);
    }
  }
  const std::string name = spec.graph().component(0).name();
  statistics.SetProcess(name, Health(INT64_MAX, kStart));
  statistics.SetProcess(name, Health(INT64_MIN, kStart + 1));
  EXPECT_GE(statistics.Take(kStart + kSecond).channels[static_cast<size_t>(sensors)].missed, 0);
}

TEST_F(LiveStatisticsTest, ProcessesAreMeasuredBetweenTheirReports) {
  const std::string name = spec.graph().component(0).name();
  statistics.SetProcess(name, Health(100, kStart));
  EXPECT_LT(Process(statistics.Take(kStart + kSecond / 10), name).tick_rate, 0);  // one report
  statistics.SetProcess(name, Health(200, kStart + kSecond / 5));
  statistics.SetProcess(name, Health(350, kStart + kSecond / 2));
  LiveSnapshot snapshot = statistics.Take(kStart + kSecond);
  EXPECT_DOUBLE_EQ(Process(snapshot, name).tick_rate, 500);
  EXPECT_DOUBLE_EQ(Process(snapshot, name).age, 0.5);
  EXPECT_EQ(Process(snapshot, name).health.tick, 350);
  // Without a report since, the last rate stays, and the age tells.
  snapshot = statistics.Take(kStart + 2 * kSecond);
  EXPECT_DOUBLE_EQ(Process(snapshot, name).tick_rate, 500);
  EXPECT_DOUBLE_EQ(Process(snapshot, name).age, 1.5);
}

TEST_F(LiveStatisticsTest, AllProcessesAndTheRecorderAreThereUnseen) {
  const LiveSnapshot snapshot = statistics.Take(kStart + kSecond);
  ASSERT_EQ(snapshot.processes.size(), static_cast<size_t>(spec.graph().component_size()) + 1);
  EXPECT_EQ(snapshot.processes.back().name, "recorder");
  for (const auto& process : snapshot.processes) EXPECT_FALSE(process.seen);
}

}  // namespace
}  // namespace poise
