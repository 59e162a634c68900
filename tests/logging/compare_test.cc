#include "logging/replay/compare.h"

#include <gtest/gtest.h>

#include <cmath>

#include "logging/run_log_writer.h"
#include "poise/message_traits.hpp"
#include "poise/robot_state_t.hpp"
#include "poise/task_torque_t.hpp"
#include "tests/logging/log_test_support.h"

namespace poise::logging {
namespace {

constexpr int64_t kCompareTicks = 10;

class CompareTest : public testing::Test {
 protected:
  CompareTest() : spec_(MakeTestSpec()) {
    for (int64_t t = 0; t < kCompareTicks; ++t) {
      robot_state_t state{};
      MessageTraits<robot_state_t>::Resize(state, std::vector<int32_t>{12, 2});
      SetHeader(t, &state);
      state.base_position[2] = 0.1 * static_cast<double>(t);
      states_.push_back(state);
      task_torque_t task{};
      MessageTraits<task_torque_t>::Resize(task, std::vector<int32_t>{12});
      SetHeader(t, &task);
      tasks_.push_back(task);
    }
  }

  std::string Write(const char* name, const std::vector<robot_state_t>& states,
                    const std::vector<task_torque_t>& tasks) {
    std::vector<RawEvent> events = {RunInfoEvent(spec_)};
    for (const robot_state_t& state : states) {
      events.push_back({"ROBOT_STATE", state.utime, Encode(state)});
    }
    for (const task_torque_t& task : tasks) {
      events.push_back({"TASK_TORQUE", task.utime, Encode(task)});
    }
    WriteRawLog(folder_.path(name), events);
    return folder_.path(name);
  }

  TemporaryFolder folder_;
  RunSpec spec_;
  std::vector<robot_state_t> states_;
  std::vector<task_torque_t> tasks_;
};

TEST_F(CompareTest, RunIdAloneIsNoDifference) {
  const std::string first = Write("a", states_, tasks_);
  for (robot_state_t& state : states_) state.run_id = 77;
  const LogComparison result = CompareLogs(first, Write("b", states_, tasks_));
  EXPECT_TRUE(result.equal());
  EXPECT_EQ(result.ticks, kCompareTicks);
  EXPECT_EQ(result.messages, 2 * kCompareTicks);
  EXPECT_FALSE(result.earliest.has_value());
}

TEST_F(CompareTest, OneBitIsFoundAndNamed) {
  const std::string first = Write("a", states_, tasks_);
  tasks_[4].torque[7] = -0.0;  // one bit away from 0.0, and equal to it as a number
  states_[6].base_position[2] = std::nextafter(states_[6].base_position[2], 1);
  const LogComparison result = CompareLogs(first, Write("b", states_, tasks_));
  EXPECT_EQ(result.differing, 2);
  ASSERT_TRUE(result.earliest.has_value());
  EXPECT_EQ(result.earliest->tick, 4);
  EXPECT_EQ(result.earliest->channel, "TASK_TORQUE");
  EXPECT_EQ(result.earliest->field, "torque[7]");
  EXPECT_EQ(result.earliest->first, "0");
  EXPECT_EQ(result.earliest->second, "-0");
}

TEST_F(CompareTest, MissingMessagesAreDifferences) {
  const std::string first = Write("a", states_, tasks_);
  states_.erase(states_.begin() + 2);
  const std::string second = Write("b", states_, tasks_);
  const LogComparison result = CompareLogs(first, second);
  EXPECT_FALSE(result.equal());
  EXPECT_EQ(result.only_first, 1);
  EXPECT_EQ(result.earliest->tick, 2);
  EXPECT_EQ(result.earliest->second, "absent");
  EXPECT_EQ(CompareLogs(second, first).only_second, 1);
}

TEST_F(CompareTest, OtherChannelsCannotBeCompared) {
  const std::string first = Write("a", states_, tasks_);
  spec_.mutable_graph()->mutable_channel(0)->set_name("ELSE");
  EXPECT_THROW(CompareLogs(first, Write("b", states_, tasks_)), LogError);
}

}  // namespace
}  // namespace poise::logging
