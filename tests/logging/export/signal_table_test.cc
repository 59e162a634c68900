#include "logging/export/signal_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string_view>

#include "logging/derived/tick_messages.h"
#include "poise/drive_feedback_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "tests/logging/log_test_support.h"
#include "tests/logging/record_fixture.h"

namespace poise::logging {
namespace {

using testing::ElementsAre;

class SignalTableTest : public testing::Test {
 protected:
  template <class T>
  static T Message(int64_t tick) {
    T message{};
    std::vector<int32_t> counts;
    for (const char* name : MessageTraits<T>::kCountNames) {
      counts.push_back(std::string_view(name) == "num_feet" ? 2 : 12);
    }
    MessageTraits<T>::Resize(message, counts);
    SetHeader(tick, &message);
    return message;
  }
  template <class T>
  static RawEvent Event(const char* channel, const T& message) {
    return {channel, message.utime, Encode(message)};
  }
  /// The log's own channels, without what follows from them.
  std::vector<ChannelColumns> Read(std::vector<RawEvent> events) {
    events.insert(events.begin(), RunInfoEvent(spec_));
    WriteRawLog(path_, events);
    std::vector<ChannelColumns> channels = ReadColumns(path_, ReadRun(path_));
    std::erase_if(channels, [](const ChannelColumns& c) { return c.name == kDerivedChannel; });
    return channels;
  }
  static const SignalColumn* Find(const ChannelColumns& channel, const std::string& field) {
    for (const SignalColumn& column : channel.columns) {
      if (column.field == field) return &column;
    }
    return nullptr;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path("run.lcm");
  RunSpec spec_ = MakeTestSpec();
};

TEST_F(SignalTableTest, HoldsEveryScalarButTheHeader) {
  ground_truth_t truth = Message<ground_truth_t>(0);
  truth.foot_wrench[1].force[2] = -267.5;
  truth.foot_contact_points[0] = 4;
  const auto channels = Read({Event("GROUND_TRUTH", truth)});
  ASSERT_EQ(channels.size(), 1u);
  EXPECT_EQ(channels[0].name, "GROUND_TRUTH");
  EXPECT_EQ(channels[0].type, "ground_truth_t");
  // 3 + 4 + 3 + 3 of the base, 4 of each joint, 6 of the COM, 7 + 6 + 1 of each foot, 3 of the
  // push, fallen and utime.
  EXPECT_EQ(channels[0].columns.size(), 13u + 4 * 12 + 6 + 14 * 2 + 3 + 2 + 7);
  for (const char* header : {"run_id", "tick", "num_joints", "num_feet"}) {
    EXPECT_EQ(Find(channels[0], header), nullptr) << header;
  }
  EXPECT_THAT(Find(channels[0], "foot_wrench[1].force[2]")->values, ElementsAre(-267.5));
  EXPECT_FALSE(Find(channels[0], "foot_wrench[1].force[2]")->integer);
  EXPECT_THAT(Find(channels[0], "foot_contact_points[0]")->values, ElementsAre(4));
  EXPECT_TRUE(Find(channels[0], "foot_contact_points[0]")->integer);
}

TEST_F(SignalTableTest, SortsTicksAndTakesTheFirstOfTwo) {
  std::vector<RawEvent> events;
  for (const auto& [tick, force] : {std::pair{3, 30.0}, {1, 10.0}, {3, 99.0}, {0, 0.0}}) {
    auto push = Message<external_push_t>(tick);
    push.force[1] = force;
    events.push_back(Event("EXTERNAL_PUSH", push));
  }
  const auto channels = Read(events);
  ASSERT_EQ(channels.size(), 1u);
  EXPECT_THAT(channels[0].ticks, ElementsAre(0, 1, 3));
  EXPECT_THAT(Find(channels[0], "force[1]")->values, ElementsAre(0, 10, 30));
}

TEST_F(SignalTableTest, ShowsNumbersThatAreNotFinite) {
  auto command = Message<joint_command_t>(0);
  command.torque[5] = std::numeric_limits<double>::quiet_NaN();
  const auto channels =
      Read({Event("JOINT_COMMAND", command), Event("JOINT_COMMAND", Message<joint_command_t>(1))});
  ASSERT_EQ(channels.size(), 1u);
  ASSERT_EQ(channels[0].ticks.size(), 2u);
  EXPECT_TRUE(std::isnan(Find(channels[0], "torque[5]")->values[0]));
  EXPECT_EQ(Find(channels[0], "torque[5]")->values[1], 0);
}

TEST_F(SignalTableTest, WhatAMessageDoesNotTellIsNoNumber) {
  auto sensors = Message<robot_sensors_t>(0);
  sensors.foot_sensor[0] = drive_feedback_t::SENSOR_ABSENT;
  auto silent = Message<joint_command_t>(0), left = Message<joint_command_t>(1),
       infeasible = Message<joint_command_t>(2);
  left.in_contact[1] = left.conditions_met[1] = left.eta_feasible = 1;
  left.foot_wrench[1].force[2] = -98;
  infeasible.eta_max = 1;
  auto needed = Message<planner_status_t>(1);
  needed.step_needed = 1;
  const auto channels =
      Read({Event("ROBOT_SENSORS", sensors), Event("PLANNER_STATUS", Message<planner_status_t>(0)),
            Event("JOINT_COMMAND", silent), Event("JOINT_COMMAND", left),
            Event("JOINT_COMMAND", infeasible), Event("PLANNER_STATUS", needed),
            Event("ESTIMATOR_STATUS", Message<estimator_status_t>(0))});
  const auto values = [&](const std::string& name, const std::string& field) {
    for (const ChannelColumns& channel : channels) {
      if (channel.name == name) return Find(channel, field)->values;
    }
    return std::vector<double>{};
  };
  const auto none = testing::IsNan();
  EXPECT_THAT(values("ROBOT_SENSORS", "foot_wrench[0].force[2]"), ElementsAre(none));
  EXPECT_THAT(values("ROBOT_SENSORS", "foot_wrench[1].force[2]"), ElementsAre(0));
  EXPECT_THAT(values("ESTIMATOR_STATUS", "covariance[0]"), ElementsAre(none));
  EXPECT_THAT(values("PLANNER_STATUS", "step_time"), ElementsAre(none, 0));
  EXPECT_THAT(values("PLANNER_STATUS", "step_position[2]"), ElementsAre(none, 0));
  EXPECT_THAT(values("JOINT_COMMAND", "torque[3]"), ElementsAre(0, 0, 0));
  // A foot in the air bears nothing, which is told, and has no margin.
  EXPECT_THAT(values("JOINT_COMMAND", "foot_wrench[0].force[2]"), ElementsAre(none, 0, none));
  EXPECT_THAT(values("JOINT_COMMAND", "foot_wrench[1].force[2]"), ElementsAre(none, -98, none));
  EXPECT_THAT(values("JOINT_COMMAND", "margins[0].roll"), ElementsAre(none, none, none));
  EXPECT_THAT(values("JOINT_COMMAND", "margins[1].roll"), ElementsAre(none, 0, none));
  EXPECT_THAT(values("JOINT_COMMAND", "eta_optimal"), ElementsAre(none, 0, 0));
  EXPECT_THAT(values("JOINT_COMMAND", "eta_max"), ElementsAre(none, 0, 1));
}

TEST_F(SignalTableTest, LeavesOutWhatIsOfAnotherRunOrOfNoChannel) {
  auto foreign = Message<external_push_t>(0);
  foreign.run_id = 41;
  RawEvent cut = Event("EXTERNAL_PUSH", Message<external_push_t>(1));
  cut.data.pop_back();
  const auto channels =
      Read({Event("GROUND_TRUTH", Message<ground_truth_t>(2)), Event("EXTERNAL_PUSH", foreign), cut,
            Event("SOMETHING", Message<external_push_t>(1))});
  ASSERT_EQ(channels.size(), 1u);
  EXPECT_EQ(channels[0].name, "GROUND_TRUTH");
}

TEST_F(SignalTableTest, PlacesExternalMessagesByTheirRecording) {
  emergency_stop_t stop{};
  stop.run_id = 42;
  stop.stop = 1;
  RawEvent event = Event("EMERGENCY_STOP", stop);
  event.utime = 6000;
  const auto channels = Read({Event("GROUND_TRUTH", Message<ground_truth_t>(9)), event});
  ASSERT_EQ(channels.size(), 2u);
  EXPECT_EQ(channels[1].name, "EMERGENCY_STOP");
  EXPECT_THAT(channels[1].ticks, ElementsAre(3));
}

TEST_F(SignalTableTest, TakesHealthOverTime) {
  std::vector<RawEvent> events = {Event("GROUND_TRUTH", Message<ground_truth_t>(9))};
  for (const int64_t tick : {2, 7}) {
    health_t health{};
    SetHeader(tick, &health);
    health.component = "sim";
    health.gaps = 10 * tick;
    events.push_back(Event("HEALTH_SIM", health));
  }
  const auto channels = Read(events);
  ASSERT_EQ(channels.size(), 2u);
  EXPECT_EQ(channels[1].type, "health_t");
  EXPECT_THAT(channels[1].ticks, ElementsAre(2, 7));
  EXPECT_THAT(Find(channels[1], "gaps")->values, ElementsAre(20, 70));
  EXPECT_EQ(Find(channels[1], "component"), nullptr);
}

}  // namespace
}  // namespace poise::logging
