// A damaged log is refused with one line, or read; it never takes the reader down.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "components/robot/robot_model.h"
#include "logging/events/events.h"
#include "logging/metrics/metrics.h"
#include "logging/replay/compare.h"
#include "logging/run_log_writer.h"
#include "logging/run_record.h"
#include "poise/message_traits.hpp"
#include "tests/logging/log_test_support.h"
#include "tests/test_seed.h"

namespace poise::logging {
namespace {

constexpr int64_t kDamageTicks = 5;

class DamageTest : public testing::Test {
 protected:
  DamageTest() : spec_(MakeTestSpec()) { spec_.set_num_ticks(kDamageTicks); }

  /// Log with `info` first and kDamageTicks messages of three channels and of HEALTH.
  std::string Write(const RawEvent& info) {
    std::vector<RawEvent> events = {info};
    for (int64_t t = 0; t < kDamageTicks; ++t) {
      events.push_back(Zeros<robot_state_t>("ROBOT_STATE", t));
      events.push_back(Zeros<task_torque_t>("TASK_TORQUE", t));
      events.push_back(Zeros<joint_command_t>("JOINT_COMMAND", t));
    }
    events.push_back(Health("HEALTH_SIM", "sim"));
    WriteRawLog(folder_.path("log"), events);
    return folder_.path("log");
  }
  std::string WriteSpec() { return Write(RunInfoEvent(spec_)); }

  template <class T>
  static RawEvent Zeros(const char* channel, int64_t tick) {
    T message{};
    std::vector<int32_t> counts{12, 2};
    counts.resize(MessageTraits<T>::kCountNames.size());
    MessageTraits<T>::Resize(message, counts);
    SetHeader(tick, &message);
    return {channel, message.utime, Encode(message)};
  }
  static RawEvent Health(const char* channel, const std::string& component) {
    health_t health{};
    SetHeader(0, &health);
    health.component = component;
    return {channel, 0, Encode(health)};
  }

  /// What ReadRun says of the log; empty when it reads it.
  static std::string Refusal(const std::string& path) {
    try {
      ReadRun(path);
    } catch (const LogError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
  RunSpec spec_;
};

TEST_F(DamageTest, RunInfoWithRandomDamage) {
  const RawEvent good = RunInfoEvent(spec_);
  const run_info_t info = MakeRunInfo(spec_, "");
  const std::string intact = folder_.path("intact");
  WriteBytes(intact, ReadBytes(Write(good)));
  // The robot's and the URDF's texts are the larger part by far: half of the damage goes elsewhere.
  const size_t spec_end = 8 + 24 + 4 + info.run_spec.size();
  std::mt19937 random(TestSeed(7));
  int refused = 0;
  int read = 0;
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    RawEvent damaged = good;
    const size_t reach = i % 2 == 0 ? spec_end : damaged.data.size();
    for (size_t n = 1 + random() % 4; n > 0; --n) {
      damaged.data[random() % reach] = static_cast<uint8_t>(random());
    }
    const std::string path = Write(damaged);
    std::string what;
    try {
      RunRecord run = ReadRun(path);
      for (const Metric& metric : Metrics()) metric.compute(run);
      Events(run);
      ++read;
    } catch (const LogError& error) {
      what = error.what();
    } catch (const robot::RobotError& error) {
      what = error.what();
    }
    try {
      CompareLogs(intact, path);
    } catch (const LogError& error) {
      EXPECT_NE(std::string(error.what()), "");
      const bool renamed =
          std::string(error.what()).find("different channels") != std::string::npos;
      EXPECT_TRUE(renamed || !what.empty()) << "refused by compare alone: " << error.what();
    }
    if (!what.empty()) ++refused;
  }
  EXPECT_EQ(refused + read, 300);
  EXPECT_GT(refused, 30);
  EXPECT_GT(read, 3);
}

TEST_F(DamageTest, SpecThatCannotBeIsRefusedByField) {
  EXPECT_EQ(Refusal(WriteSpec()), "");
  const RunSpec good = spec_;
  for (const double period : {0.0, -0.002, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    spec_.set_tick_period(period);
    EXPECT_NE(Refusal(WriteSpec()).find("tick_period"), std::string::npos) << period;
  }
  spec_ = good;
  spec_.set_num_ticks(-1);
  EXPECT_NE(Refusal(WriteSpec()).find("num_ticks"), std::string::npos);
  for (const int32_t joints : {-1, 0, 11, 13, 1 << 30}) {
    spec_ = good;
    spec_.mutable_graph()
        ->mutable_channel(ChannelIndex(spec_, "JOINT_COMMAND"))
        ->set_count(0, joints);
    EXPECT_NE(Refusal(WriteSpec()).find("num_joints"), std::string::npos) << joints;
  }
  spec_ = good;
  spec_.mutable_graph()->mutable_channel(ChannelIndex(spec_, "SUPPORT_PLAN"))->set_count(0, 1);
  EXPECT_NE(Refusal(WriteSpec()).find("num_feet"), std::string::npos);
}

TEST_F(DamageTest, CompareRefusesAnUnknownType) {
  const std::string intact = folder_.path("intact");
  WriteBytes(intact, ReadBytes(WriteSpec()));
  for (const char* type : {"no_such_t", "wrench_t"}) {
    spec_.mutable_graph()->mutable_channel(0)->set_type(type);
    EXPECT_THROW(CompareLogs(intact, WriteSpec()), LogError) << type;
  }
}

TEST_F(DamageTest, MessagesThatAreNotFiniteAreUnreadable) {
  RawEvent bad = Zeros<robot_state_t>("ROBOT_STATE", 0);
  robot_state_t state{};
  MessageTraits<robot_state_t>::Resize(state, std::vector<int32_t>{12, 2});
  SetHeader(0, &state);
  state.joint_velocity[3] = std::numeric_limits<double>::quiet_NaN();
  bad.data = Encode(state);
  WriteRawLog(folder_.path("log"),
              {RunInfoEvent(spec_), bad, Zeros<robot_state_t>("ROBOT_STATE", 1)});
  const RunRecord run = ReadRun(folder_.path("log"));
  EXPECT_EQ(run.state.at(0), nullptr);
  EXPECT_NE(run.state.at(1), nullptr);
  for (const ChannelCompleteness& channel : run.channels) {
    EXPECT_EQ(channel.refused, channel.name == "ROBOT_STATE" ? 1 : 0) << channel.name;
  }
}

TEST_F(DamageTest, HealthCountsUnderItsOwnNameOnly) {
  WriteRawLog(folder_.path("log"),
              {RunInfoEvent(spec_), Health("HEALTH_SIM", "sim"), Health("HEALTH_SIM", "\xFF\xFE"),
               Health("HEALTH_HW_BRIDGE", "sim")});
  const RunRecord run = ReadRun(folder_.path("log"));
  EXPECT_EQ(run.health.size(), 1u);
  EXPECT_EQ(run.health.count("sim"), 1u);
  EXPECT_EQ(run.refused_health, 2);
}

}  // namespace
}  // namespace poise::logging
